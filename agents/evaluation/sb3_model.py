"""Models that Stable-Baselines3 has saved, of any of its algorithms, as controllers."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from agents.evaluation.statistics import Normalised, Statistics, statistics_beside
from elbow_gym.vector_env import ElbowArmVectorEnv


def check_trust(path: Path, trust: bool) -> None:
    """Raises ValueError unless a .zip, whose pickles can run any code when they are read, is trusted."""
    if not trust:
        raise ValueError(f"--trust must be given for {path}, whose pickles can run any code when they are read")


def load_model(path: Path, env: ElbowArmVectorEnv) -> Any:
    """The controller in a .zip of `model.save`, whose `predict` takes batches. See `read_model` for the rest."""
    saved = read_model(path, env)
    return saved.policy if saved.statistics is None else Normalised(saved.policy, saved.statistics)


class SavedModel(NamedTuple):
    """What a .zip of `model.save` says of how a model acts."""

    algorithm: str
    """Name of the algorithm, such as "PPO"; TD3 for DDPG, whose policies are of the same class."""
    policy: Any
    """Policy, whose `predict` takes batches of the observations of its training."""
    statistics: Statistics | None
    """How these differ from the environment's; None where they do not."""


def read_model(path: Path, env: ElbowArmVectorEnv) -> SavedModel:
    """The model in a .zip of `model.save`.

    The statistics of a `VecNormalize` in training are in another file, which is looked for beside the .zip.

    Args:
        path: the .zip, a file that is trusted: its pickles can run any code when they are read.
        env: the environment that the policy will act in.

    Raises:
        ValueError: the file is no model's, its spaces are not the environment's, it is recurrent, or it was trained on
            other observations and the statistics are missing or another training's.
        DependencyNotInstalled: Stable-Baselines3 is missing.
    """
    try:
        from stable_baselines3.common.save_util import load_from_zip_file
    except ImportError as error:
        from gymnasium.error import DependencyNotInstalled

        raise DependencyNotInstalled(f'{path} needs Stable-Baselines3: pip install -e ".[agents]" ({error})') from error
    try:
        data, parameters, _ = load_from_zip_file(path, device="cpu")
    # A damaged zip, or a pickle of what is not installed, raises nearly anything.
    except Exception as error:
        raise ValueError(f"{path} must be a model that Stable-Baselines3 has saved, got: {error}") from error
    if data is None or "policy_class" not in data or "policy" not in parameters:
        raise ValueError(f"{path} must be a model that Stable-Baselines3 has saved, got another .zip")
    for name, own in (("observation", env.single_observation_space), ("action", env.single_action_space)):
        if (given := data[f"{name}_space"]) != own:
            raise ValueError(f"{name} space of {path} must be the environment's {_shown(own)}, got {_shown(given)}")
    options = {"use_sde": True} if data.get("use_sde") else {}
    policy = data["policy_class"](
        data["observation_space"], data["action_space"], lambda _: 0.0, **{**options, **data["policy_kwargs"]}
    )
    if hasattr(policy, "lstm_actor"):
        raise ValueError(f"{path} must hold a policy without memory, got {type(policy).__name__}")
    policy.load_state_dict(parameters["policy"])
    policy.set_training_mode(False)
    statistics = statistics_beside(path, data.get("_last_obs"), env.observation_names)
    algorithm = type(policy).__module__.split(".")[1].upper()
    if algorithm == "COMMON":
        # PPO and A2C have one class of policies.
        algorithm = "PPO" if "clip_range" in data else "A2C"
    return SavedModel(algorithm, policy, statistics)


def _shown(space: Any) -> str:
    """A space in words: its shape alone where its bounds differ between the entries, of which there may be many."""
    text = str(space)
    return text if "\n" not in text and len(text) < 80 else f"{type(space).__name__} of shape {space.shape}"

"""Models that Stable-Baselines3 has saved, of any of its algorithms, as controllers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from elbow_gym.vector_env import ElbowArmVectorEnv


def check_trust(path: Path, trust: bool) -> None:
    """Raises ValueError unless a .zip, whose pickles can run any code when they are read, is trusted."""
    if not trust:
        raise ValueError(f"--trust must be given for {path}, whose pickles can run any code when they are read")


def load_model(path: Path, env: ElbowArmVectorEnv) -> Any:
    """The policy in a .zip of `model.save`, which acts deterministically; its `predict` takes batches.

    The file says nothing of a `VecNormalize` in training: such a model is exported with its statistics, see
    `agents.learning.actor.policy_of`.

    Args:
        path: the .zip, a file that is trusted: its pickles can run any code when they are read.
        env: the environment that the policy will act in.

    Raises:
        ValueError: the file is no model's, its spaces are not the environment's, or it is recurrent.
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
        if data[f"{name}_space"] != own:
            raise ValueError(f"{name} space of {path} must be the environment's {own}, got {data[f'{name}_space']}")
    options = {"use_sde": True} if data.get("use_sde") else {}
    policy = data["policy_class"](
        data["observation_space"], data["action_space"], lambda _: 0.0, **{**options, **data["policy_kwargs"]}
    )
    if hasattr(policy, "lstm_actor"):
        raise ValueError(f"{path} must hold a policy without memory, got {type(policy).__name__}")
    policy.load_state_dict(parameters["policy"])
    policy.set_training_mode(False)
    return policy

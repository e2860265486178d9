"""Export of policies as ONNX files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from agents.evaluation.onnx_model import contract_path, write_onnx
from agents.evaluation.own import located
from agents.evaluation.statistics import statistics_file
from agents.learning.actor import policy_of
from agents.shipped.seeds import load_policy
from agents.task_options import TaskOptions
from elbow_gym.baselines.policy import Policy, read_policy
from elbow_gym.vector_env import ElbowArmVectorEnv

if TYPE_CHECKING:
    from elbow_gym.task.settings import Settings

MODELS = ("PPO", "SAC", "A2C", "TD3")
"""Algorithms of Stable-Baselines3 with continuous actions, DDPG being read as TD3."""


def export(what: str, output: Path, task: TaskOptions, trust: bool) -> str:
    """Writes a policy as an ONNX file with its contract beside it; a sentence with what was written.

    Args:
        what: shipped algorithm, folder of a run, policy's file, or Stable-Baselines3 .zip.
        output: the .onnx file.
        task: environment of a .zip, and of the shipped policy that is meant.
        trust: whether a .zip may be read, whose pickles can run any code.

    Raises:
        ValueError: there is no such policy, it is no multilayer perceptron, or a .zip is not trusted.
        DependencyNotInstalled: onnx or ONNX Runtime is missing.
    """
    path = located(what)
    if path is None:
        policy = load_policy(
            what, elbows=2 if task.elbows is None and task.env == "ElbowArm-v0" else task.elbows, env=task.env
        )
    elif path.suffix == ".zip":
        policy = _of_zip(path, task.settings(), task.env, trust)
    else:
        policy = read_policy(path)
    difference = write_onnx(policy, output)
    return f"{output} and {contract_path(output).name}: actions differ from the policy's by {difference:.1g} at most"


def _of_zip(path: Path, settings: Settings, env: str, trust: bool) -> Policy:
    """The policy in a .zip of `model.save`, in the environment that it was trained in."""
    import stable_baselines3 as sb3
    from stable_baselines3.common.vec_env import VecNormalize

    from agents.evaluation.sb3_model import check_trust, read_model
    from elbow_gym.sb3 import SB3VecEnv

    check_trust(path, trust)
    batch = ElbowArmVectorEnv(1, **settings.arguments, autoreset_mode="SameStep")
    saved = read_model(path, batch)
    if saved.algorithm not in MODELS:
        raise ValueError(f"{path} must be a model of one of {MODELS}, got {saved.algorithm}")
    arms = SB3VecEnv(batch)
    file = statistics_file(path)
    trained = arms if saved.statistics is None or file is None else VecNormalize.load(str(file), arms)
    model = getattr(sb3, saved.algorithm).load(path, env=trained, device="cpu")
    return policy_of(model, settings, f"{path.name} of Stable-Baselines3", env)

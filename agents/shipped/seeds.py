"""Shipped policies by algorithm, task and training seed: the baselines and the seeds beside them."""

from __future__ import annotations

from pathlib import Path

from agents.shipped import POLICIES
from elbow_gym.baselines.policy import BASELINES, Policy, baseline_path, read_policy
from elbow_gym.baselines.policy import load_policy as load_baseline
from elbow_gym.baselines.policy_card import PolicyCard
from elbow_gym.baselines.tasks import task_name


def load_policy(
    source: str | Path, elbows: int | None = None, env: str | None = None, seed: int | None = None
) -> Policy:
    """A policy from a file, or a shipped one: `load_policy("ppo", elbows=2)`, `load_policy("ppo", env="...")`.

    Args:
        source: a path with or without suffix; with `elbows`, `env` or `seed` a shipped policy's algorithm.
        elbows: number of elbows in training; that of `env` when None.
        env: id of the environment in training; "ElbowArm-v0" when None.
        seed: seed of the training; the one with the best return at its evaluation when None.

    Raises:
        ValueError: there is no such policy, or its files do not fit each other.
    """
    if seed is None:
        return load_baseline(source, elbows, env)
    return read_policy(shipped_path(f"{source}_{task_name(env or 'ElbowArm-v0', elbows)}", seed))


def shipped_path(name: str, seed: int) -> Path:
    """Path of the policy of an algorithm and task, such as "ppo_elbows2", and a training seed, without suffix.

    Raises:
        ValueError: it is not shipped.
    """
    best = baseline_path(name)
    if seed not in shipped_seeds(name):
        raise ValueError(f"seed of {name} must be one of {shipped_seeds(name)}, got {seed}")
    return best if best.name == f"{name}_seed{seed}" else POLICIES / f"{name}_seed{seed}"


def shipped_seeds(name: str) -> list[int]:
    """Training seeds of the shipped policies of an algorithm and task, such as "ppo_elbows2"."""
    stems = [path.rpartition("_seed") for path in shipped_policies()]
    return sorted(int(seed) for known, _, seed in stems if known == name)


def shipped_policies() -> list[str]:
    """Names of all shipped policies, such as "ppo_elbows2_seed0"."""
    return sorted(path.stem for folder in (BASELINES, POLICIES) for path in folder.glob("*.json"))


def check_name(what: str, name: str, card: PolicyCard) -> None:
    """Raises ValueError unless the name of files is the one of the policy with this card. `what` the message names."""
    elbows = card.environment.get("elbows")
    # JSON has no tuples.
    task = task_name(card.env, tuple(elbows) if isinstance(elbows, list) else elbows)
    ends = f"_{task}_seed{card.training.get('seed')}"
    if not (name.startswith(card.algorithm) and name.endswith(ends)):
        raise ValueError(f"{what} must be named {card.algorithm}[_LABEL]{ends} as what they hold, got {name}")

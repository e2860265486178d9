"""Tasks of `ElbowArmTasks-v0` as reset options: the one that an info tells of, and fifty for evaluation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Integral
from typing import Any

import gymnasium as gym
import numpy as np

from elbow_gym.task.circle import DIRECTIONS
from elbow_gym.task.infos import of_arm, unmasked

ENV = "ElbowArmTasks-v0"
"""Id whose resets draw the tasks."""
FIRST_SEED = 2**32
"""Seed of the first evaluation task. No training draws from it: NumPy's and PyTorch's global generators and
`integers(2**31)`, which trainings take their seeds from, stay below."""
EVALUATION_SEEDS = tuple(range(FIRST_SEED, FIRST_SEED + 50))
"""Seeds of the evaluation tasks: fixed and public; no training and no choice of a policy uses them."""


def reset_options(info: Mapping[str, Any]) -> dict[str, Any]:
    """Options of a reset that set the task of an info again, bit for bit, in plain JSON types.

    They have what was drawn: the circle's fields, the arm's parameters, the start pose q [rad]. What is not drawn in an
    environment, such as its circle's shape, is its own.

    Args:
        info: info of a reset or step of a single environment.
    """
    options: dict[str, Any] = {}
    if "circle" in info:
        circle = {name: np.asarray(value).tolist() for name, value in info["circle"].items()}
        circle["direction"] = DIRECTIONS[int(circle.pop("rate") < 0.0)]
        options["circle"] = circle
    if "parameters" in info:
        options["parameters"] = {name: np.asarray(value).tolist() for name, value in info["parameters"].items()}
    if "start" in info:
        options["state"] = {"q": np.asarray(info["start"]["q"]).tolist()}
    return options


def evaluation_tasks(elbows: int = 2, seeds: Sequence[int] = EVALUATION_SEEDS) -> list[dict[str, Any]]:
    """The fifty evaluation tasks, or those of other seeds, as options of a reset of `ElbowArmTasks-v0`.

    Each has, in plain JSON types, `circle` with all of its fields but the shape, `parameters` with the payload [kg]
    alone, and `state` with the start pose q [rad]. They are what resets with the seeds draw.

    Args:
        elbows: number of elbows on the table, 0, 1 or 2.
        seeds: seeds of the resets, one for each task. From below 2**31 a training may have drawn one of them.

    Raises:
        ValueError: elbows is another number, there are no seeds, or one is not an integer of at least 0.
    """
    if elbows not in (0, 1, 2) or isinstance(elbows, bool):
        raise ValueError(f"elbows must be 0, 1 or 2, got {elbows!r}")
    if len(seeds) == 0 or not all(isinstance(seed, Integral) and seed >= 0 for seed in seeds):
        raise ValueError(f"seeds must be integers of at least 0, one or more, got {seeds!r}")
    arms: Any = gym.make_vec(ENV, num_envs=len(seeds), elbows=elbows)
    _, infos = arms.reset(seed=list(seeds))
    drawn = unmasked(infos)
    arms.close()
    tasks = [reset_options(of_arm(drawn, i)) for i in range(len(seeds))]
    return [{**task, "parameters": {"payload": task["parameters"]["payload"]}} for task in tasks]

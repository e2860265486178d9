"""Settings of the registered environments, and the names of runs, policies and curves."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elbow_gym.baselines.tasks import registered_arguments

if TYPE_CHECKING:
    from elbow_gym.task.settings import Settings

POLICY_NAME = re.compile(r"(?P<controller>[a-z]+(_[a-z]+)??)_(?P<task>elbows\d+|table|random|tasks(_elbows\d+)?)")
"""Names of the files of policies and curves before "_seedK": ALGORITHM[_LABEL]_TASK."""
RUNS = Path("runs")
"""Folder in which trainings make theirs, unless another is asked for."""
BEST = "best"
"""Name of the best policy's files in the folder of a run."""

Elbows = int | tuple[int, ...]
"""Elbows on the table: 0, 1, 2 as in the paper, or joint numbers."""


def task_settings(env: str, elbows: Elbows | None = None, more: Mapping[str, Any] | None = None) -> Settings:
    """`Settings` of a registered environment.

    Args:
        env: one of `elbow_gym.baselines.tasks.ENVIRONMENTS`.
        elbows: elbows on the table; that of the id, or else 2, when None.
        more: arguments that take precedence over the id's.
    """
    from elbow_gym.task.settings import Settings

    chosen = {} if elbows is None else {"elbows": elbows}
    return Settings(**{**registered_arguments(env), **chosen, **(more or {})})


def settings_of_task(elbows: Elbows, task: Mapping[str, Any]) -> Settings:
    """`Settings` of one task of `ElbowArmTasks-v0`, with nothing drawn, as a planner or a bound needs it.

    Its episode is the one that `task` sets; the start pose is the arm's nominal one, and the task is not observed.

    Args:
        elbows: elbows on the table.
        task: options of a reset, as `elbow_gym.evaluation_tasks` has them: `circle` with all that is drawn, `state`
            with q [rad], and `parameters` with the payload [kg].
    """
    from elbow_gym.parameters import paper_arm
    from elbow_gym.task.settings import Settings

    arm = replace(paper_arm(), nominal_pose=tuple(task["state"]["q"]))
    load = task["parameters"]["payload"]
    return Settings(elbows=elbows, arm=arm, circle=task["circle"], payload=load, start_noise=0.0)


def plain_arguments(settings: Settings) -> dict[str, Any]:
    """Arguments of an environment by name, JSON types only, an arm and a circle as dicts of their fields."""
    return json.loads(json.dumps(settings.arguments, default=lambda value: value.to_dict()))

"""Settings of the registered environments, and the names of runs, policies and curves."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elbow_gym.baselines.tasks import registered_arguments

if TYPE_CHECKING:
    from elbow_gym.task.settings import Settings

POLICY_NAME = re.compile(r"(?P<controller>[a-z]+(_[a-z]+)??)_(?P<task>elbows\d+|table|random)")
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


def plain_arguments(settings: Settings) -> dict[str, Any]:
    """Arguments of an environment by name, JSON types only, an arm and a circle as dicts of their fields."""
    return json.loads(json.dumps(settings.arguments, default=lambda value: value.to_dict()))

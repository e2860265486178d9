"""Settings of the registered environments, and the pattern of the names of policies and curves."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from elbow_gym.baselines.tasks import registered_arguments

if TYPE_CHECKING:
    from elbow_gym.task.settings import Settings

POLICY_NAME = re.compile(r"(?P<controller>[a-z]+(_[a-z]+)??)_(?P<task>elbows\d+|table|random)")
"""Names of the files of policies and curves before "_seedK": ALGORITHM[_LABEL]_TASK."""


def task_settings(env: str, elbows: int | None = None, more: Mapping[str, Any] | None = None) -> Settings:
    """`Settings` of a registered environment.

    Args:
        env: one of `elbow_gym.baselines.tasks.ENVIRONMENTS`.
        elbows: number of elbows on the table; that of the id, or else 2, when None.
        more: arguments that take precedence over the id's.
    """
    from elbow_gym.task.settings import Settings

    chosen = {} if elbows is None else {"elbows": elbows}
    return Settings(**{**registered_arguments(env), **chosen, **(more or {})})

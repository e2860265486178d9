"""What is trained for: the settings of the registered environments, and the names of files that hold the results."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from elbow_gym.baselines.tasks import registered_arguments
from elbow_gym.task.settings import Settings

POLICY_NAME = re.compile(r"(?P<controller>[a-z]+(_[a-z]+)??)_(?P<task>elbows\d+|table|random)")
"""What files of policies and curves are called before "_seedK": ALGORITHM[_LABEL]_TASK."""


def task_settings(env: str, elbows: int | None = None, more: Mapping[str, Any] | None = None) -> Settings:
    """`Settings` of a registered environment.

    Args:
        env: one of `elbow_gym.baselines.tasks.ENVIRONMENTS`.
        elbows: elbows on the table; the id's own, or 2, when None.
        more: arguments that go before the id's.
    """
    chosen = {} if elbows is None else {"elbows": elbows}
    return Settings(**{**registered_arguments(env), **chosen, **(more or {})})

"""Tasks of the agents: registered environments and elbow counts, by the short names that files carry."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import elbow_gym  # noqa: F401  registers the environments

if TYPE_CHECKING:
    from elbow_gym.task.settings import Settings

ENVIRONMENTS = {"ElbowArm-v0": "elbows", "ElbowArmTable-v0": "table", "ElbowArmRandom-v0": "random"}
"""Short names of the tasks by the environment's id; the elbow count follows "elbows"."""
POLICY_NAME = re.compile(r"(?P<controller>[a-z]+(_[a-z]+)??)_(?P<task>elbows\d+|table|random)")
"""Names of the files of policies and curves before "_seedK": ALGORITHM[_LABEL]_TASK."""


def registered_arguments(env: str) -> dict[str, Any]:
    """Arguments that an id stands for. Raises ValueError for an id that is not in `ENVIRONMENTS`."""
    from gymnasium import spec

    if env not in ENVIRONMENTS:
        raise ValueError(f"env must be one of {list(ENVIRONMENTS)}, got {env!r}")
    return dict(spec(env).kwargs)


def task_settings(env: str, elbows: int | None = None, more: Mapping[str, Any] | None = None) -> Settings:
    """`Settings` of a registered environment.

    Args:
        env: one of `ENVIRONMENTS`.
        elbows: number of elbows on the table; that of the id, or else 2, when None.
        more: arguments that take precedence over the id's.
    """
    from elbow_gym.task.settings import Settings

    chosen = {} if elbows is None else {"elbows": elbows}
    return Settings(**{**registered_arguments(env), **chosen, **(more or {})})


def task_name(env: str, elbows: int | None = None) -> str:
    """Short name of a task: "elbows0", "elbows1", "elbows2", "table", "random"; others as "random_elbows1"."""
    given = registered_arguments(env).get("elbows", 2)
    count = given if elbows is None else elbows
    if env == "ElbowArm-v0":
        return f"elbows{count}"
    return ENVIRONMENTS[env] if count == given else f"{ENVIRONMENTS[env]}_elbows{count}"

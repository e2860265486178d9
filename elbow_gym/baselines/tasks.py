"""Short names of tasks, a registered environment with a number of elbows, as the files of policies have them."""

from __future__ import annotations

from typing import Any

ENVIRONMENTS = {
    "ElbowArm-v0": "elbows",
    "ElbowArmTable-v0": "table",
    "ElbowArmRandom-v0": "random",
    "ElbowArmTasks-v0": "tasks",
}
"""Short name of a task by the id of its environment; the number of elbows follows "elbows"."""


def registered_arguments(env: str) -> dict[str, Any]:
    """Arguments that an id was registered with. Raises ValueError for an id that is not in `ENVIRONMENTS`."""
    from gymnasium import spec

    if env not in ENVIRONMENTS:
        raise ValueError(f"env must be one of {list(ENVIRONMENTS)}, got {env!r}")
    return dict(spec(env).kwargs)


def task_name(env: str, elbows: int | tuple[int, ...] | None = None) -> str:
    """Short name of a task: "elbows0", "elbows1", "elbows2", "table", "random"; others as "random_elbows1".

    Elbows by their joints, such as (4, 7), make "joints4_7".
    """
    if isinstance(elbows, tuple):
        joints = "joints" + "_".join(map(str, elbows))
        return joints if env == "ElbowArm-v0" else f"{ENVIRONMENTS[env]}_{joints}"
    given = registered_arguments(env).get("elbows", 2)
    count = given if elbows is None else elbows
    if env == "ElbowArm-v0":
        return f"elbows{count}"
    return ENVIRONMENTS[env] if count == given else f"{ENVIRONMENTS[env]}_elbows{count}"

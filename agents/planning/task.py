"""Control periods that the collocation program is written for, and what the program does not know."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from elbow_gym.task.settings import Settings

Array = NDArray[np.float64]


class Task(Protocol):
    """Control periods to be transcribed."""

    @property
    def settings(self) -> Settings:
        """Arm, elbows, payload, supply and prices; `horizon` is the number of control periods."""
        ...

    @property
    def above_table(self) -> bool:
        """Whether joints 3..n and the hand must have z >= 0."""
        ...

    @property
    def start(self) -> Array:
        """Pose at rest that the first period starts from [rad], (n,)."""
        ...

    @property
    def target(self) -> Array:
        """Targets at the ends of the control periods [m], (N, 3)."""
        ...


def check_modelled(settings: Settings) -> None:
    """Raises ValueError naming what the program does not know: contact, friction, heat, a supply's resistance."""
    unknown = {
        "table": settings.table is not False,
        "elbow_friction": settings.elbow_friction > 0.0,
        "gear_coulomb_friction": bool((settings.parsed_arm.of_motors("gear_coulomb_friction") > 0.0).any()),
        "heat": settings.heat,
        "supply_resistance": settings.supply_resistance > 0.0,
    }
    for name, given in unknown.items():
        if given:
            raise ValueError(f"{name} must be off in the collocation program, got {getattr(settings, name)!r}")
    if not settings.regeneration:
        raise ValueError("regeneration must be True in the collocation program, got False")

"""What every controller is: something with Stable-Baselines3's `predict`, and how long that takes."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

EFFORT = {"pd_smooth": 2.0, "pd_gravity": 2.5, "computed_torque": 3.0, "computed_torque_posture": 8.0, "lqr": 8.0}
"""Of a control period, times the PD's, for an honest time left; starting takes part of it."""


class Controller(Protocol):
    """Maps observations (B, size) to actions (B, n), as SB3's models do."""

    def predict(
        self, observation: NDArray[np.float32], *args: Any, **kwargs: Any
    ) -> tuple[NDArray[np.float32], tuple[Any, ...] | None]:
        """Actions and, for recurrent controllers, their states (None here)."""
        ...

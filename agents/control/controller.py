"""Protocol of a controller: an object with Stable-Baselines3's `predict`."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


class Controller(Protocol):
    """Maps observations (B, size) to actions (B, n), as SB3's models do."""

    def predict(
        self, observation: NDArray[np.float32], *args: Any, **kwargs: Any
    ) -> tuple[NDArray[np.float32], tuple[Any, ...] | None]:
        """Actions and, for recurrent controllers, their states (None here)."""
        ...

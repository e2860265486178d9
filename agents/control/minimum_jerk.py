"""Minimum-jerk blend from one pose to another."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def minimum_jerk(fraction: ArrayLike) -> tuple[Array, Array, Array]:
    """The blend 10 s^3 - 15 s^4 + 6 s^5 of the time's fraction s, and its first two derivatives in s.

    Rises from 0 to 1 at rest and without acceleration at both ends; constant outside [0, 1].
    """
    s = np.clip(np.asarray(fraction, dtype=np.float64), 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2), 30.0 * (s * (1.0 - s)) ** 2, 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)

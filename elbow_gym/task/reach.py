"""Reach of the hand: how far a point lies outside of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.parameters import ArmParameters, Array


def reach_shortfall(arm: ArmParameters, elbows: Sequence[int], position: ArrayLike) -> Array:
    """By how much points [m], shape (..., 3), lie outside the hand's reach [m], shape (...); at most 0 inside.

    The last elbow may lie anywhere on the table within its links' length; the rest of the arm starts there.
    """
    position = np.asarray(position, dtype=np.float64)
    length = arm.of_links("length")
    bend = elbows[-1] - 1 if len(elbows) else 0
    table, free = length[:bend].sum(), length[bend:]
    rho = np.hypot(position[..., 0], position[..., 1])
    distance = np.hypot(np.maximum(rho - table, 0.0), position[..., 2])
    shortfall = distance - free.sum()
    if not len(elbows):
        # One link longer than all the others together leaves a hole around the base.
        shortfall = np.maximum(shortfall, 2.0 * free.max() - free.sum() - distance)
    return shortfall

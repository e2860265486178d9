"""The reward: its prices of tracking error and electrical power, and the charge for an episode that ends early."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elbow_gym.kernel.reward import reward
from elbow_gym.parameters import Array
from elbow_gym.task.observation import ObservationLayout


class Price(NamedTuple):
    """Prices in the reward."""

    tracking_weight: float
    """Cost per metre of tracking error at the end of a control period [1/m]."""
    energy_weight: float
    """Cost per watt of mean electrical power over a control period [1/W]."""
    control_frequency: float
    """Control periods per second [Hz]."""
    regeneration: bool
    """Whether negative electrical power is credited."""


class Charge(NamedTuple):
    """The reward's two terms and their sum, one entry per arm."""

    tracking: Array
    energy: Array
    total: Array


def early_end(
    layout: ObservationLayout, voltage: Array, resistance: Array, price: Price, periods: NDArray[np.int64]
) -> Charge:
    """Cost of control periods that will not be run, so that ending early never pays.

    In each the hand is as far off as the observation's bounds allow, and every motor draws the current of its bound or,
    where that is more, twice its stall current: that of a motor thrown from full speed into reverse.

    Args:
        layout: bounds of the observation.
        voltage: supply voltage of each arm [V], (k,).
        resistance: armature resistances [ohm], (k, n).
        price: price of error and power.
        periods: control periods left of each arm's episode, (k,).
    """
    bound = layout.high * layout.scale
    worst_error = np.linalg.norm(bound[layout.slices["hand_error"]])
    current = np.maximum(bound[layout.slices["current"]], 2.0 * voltage[:, None] / resistance).sum(axis=1)
    weights = price.tracking_weight, price.energy_weight
    terms = [
        reward(float(worst_error * left), float(power * left), *weights)
        for left, power in zip(periods, voltage * current, strict=True)
    ]
    return Charge(*np.array(terms).T)

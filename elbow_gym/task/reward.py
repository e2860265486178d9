"""The reward: its prices of tracking error and electrical power, and the charge for an episode that ends early."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elbow_gym.kernel import observe
from elbow_gym.parameters import Array
from elbow_gym.task.observation import ObservationLayout


class Price(NamedTuple):
    """What the reward charges."""

    tracking_weight: float
    """Per metre of tracking error at the end of a control step [1/m]."""
    energy_weight: float
    """Per watt of mean electrical power over it [1/W]."""
    control_frequency: float
    """Control steps per second [Hz]."""
    regeneration: bool
    """Whether negative power is credited."""


class Charge(NamedTuple):
    """The reward's two terms and their sum, one entry per arm."""

    tracking: Array
    energy: Array
    total: Array


def early_end(layout: ObservationLayout, voltage_limit: float, price: Price, periods: NDArray[np.int64]) -> Charge:
    """What control periods that will not be run cost: the worst that the observation's bounds allow in each.

    Ending early never pays.

    Args:
        layout: the bounds.
        voltage_limit: of the supply [V].
        price: of error and power.
        periods: how many are left of each arm's episode, (k,).
    """
    bound = layout.high * layout.scale
    worst_error = np.linalg.norm(bound[layout.slices["hand_error"]])
    worst_power = voltage_limit * bound[layout.slices["current"]].sum()
    tracking = -price.tracking_weight * (worst_error * periods)
    energy = -price.energy_weight * (worst_power * periods)
    total = [
        observe.fused(-worst_power * left, price.energy_weight, term)
        for left, term in zip(periods, tracking, strict=True)
    ]
    return Charge(tracking, energy, np.array(total))

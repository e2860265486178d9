"""Actions on their way to the motors: from their unit to volts, clipped to the supply and late by a delay."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from elbow_gym.kernel import observe
from elbow_gym.parameters import Array
from elbow_gym.task.arm_batch import Population
from elbow_gym.task.settings import Settings


class Actuation:
    """Supply voltage and action delay of B arms.

    Args:
        settings: the environment's arguments.
        population: the arms' parameters.
        num_envs: B.
    """

    def __init__(self, settings: Settings, population: Population, num_envs: int) -> None:
        self._population = population
        self._fraction = settings.action_unit == "fraction"
        self._longest_delay = int(settings.randomization.highest("action_delay"))
        self.queue = np.zeros((num_envs, self._longest_delay + 1, settings.parsed_arm.n_joints))
        """Voltages asked for, newest first [V], (B, 1 + longest delay, n)."""
        self._one = np.ones(num_envs)

    def check(self, values: Mapping[str, Array]) -> None:
        """Raises ValueError when an arm's actions would be later than observations make room for."""
        delay = values["action_delay"].max(initial=0.0)
        if delay > self._longest_delay:
            raise ValueError(
                f"action_delay must be at most {self._longest_delay}, the upper end of randomize's range, got {delay:g}"
            )

    def reset(self, chosen: NDArray[np.int64]) -> None:
        """The chosen arms start without voltages on their way."""
        self.queue[chosen] = 0.0

    def voltage(self, action: Array) -> Array:
        """Terminal voltages that arrive at the motors this control period [V], (B, n).

        Raises ValueError when an action is not a number, with nothing changed.
        """
        supply = self._population.values["supply_voltage"]
        highest, volts = (self._one, supply) if self._fraction else (supply, self._one)
        asked = np.empty_like(action)
        if not observe.drive(action, highest, volts, asked):
            raise ValueError(f"action must not be NaN, got {action[np.isnan(action).any(axis=1)][0].tolist()}")
        if not self._longest_delay:
            return asked
        self.queue[:, 1:] = self.queue[:, :-1].copy()
        self.queue[:, 0] = asked
        late = self._population.values["action_delay"].astype(np.int64)
        return self.queue[np.arange(len(late)), late]

"""Voltages from actions: largest action, volts per unit, and the queue of an action delay."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from elbow_gym.kernel.rows import DELAY, HIGHEST, LOAD, TASK_COLUMNS, VOLTS
from elbow_gym.parameters import Array
from elbow_gym.task.arm_batch import Population
from elbow_gym.task.settings import Settings


class Actuation:
    """Supply voltage and action delay of B arms.

    Args:
        settings: the environment's arguments.
        population: the arms' parameters.
        task: the kernel's columns of what the arms are to do, (B, TASK_COLUMNS); these are kept up to date here:
            largest action, volts per unit of action and delay, and the payload where the task is observed.
    """

    def __init__(self, settings: Settings, population: Population, task: Array) -> None:
        self._population, self._task = population, task
        self._fraction = settings.action_unit == "fraction"
        self._longest_delay = int(settings.randomization.highest("action_delay"))
        self.queue = np.zeros((len(task), self._longest_delay + 1, settings.parsed_arm.n_joints))
        """Voltages asked for, newest first [V], (B, 1 + longest delay, n)."""
        self.take_values()

    def check(self, values: Mapping[str, Array]) -> None:
        """Raises ValueError when an arm's action delay is longer than the observations have entries for."""
        delay = values["action_delay"].max(initial=0.0)
        if delay > self._longest_delay:
            raise ValueError(
                f"action_delay must be at most {self._longest_delay}, the upper end of randomize's range, got {delay:g}"
            )

    def reset(self, chosen: NDArray[np.int64]) -> None:
        """Empties the queues of the chosen arms, given by their numbers (k,)."""
        self.queue[chosen] = 0.0
        self.take_values()

    def take_values(self) -> None:
        """Takes over the supply voltages [V], action delays [control periods] and payloads [kg] of the arms' values."""
        supply = self._population.values["supply_voltage"]
        self._task[:, HIGHEST], self._task[:, VOLTS] = (1.0, supply) if self._fraction else (supply, 1.0)
        self._task[:, DELAY] = self._population.values["action_delay"]
        if self._task.shape[1] > TASK_COLUMNS:
            self._task[:, LOAD] = self._population.values["payload"]

"""The arms of a batch as they differ from each other, and what the kernel reads of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elbow_gym.parameters import ArmParameters, Array
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_rows, quantities
from elbow_gym.task.randomization import FACTORS, NUMBERS, Randomization


class Population:
    """Parameters of B arms, drawn from the nominal ones at each reset.

    Args:
        arm: the nominal arm.
        conditions: what all arms work under; its payload and supply voltage are nominal too.
        randomization: what is drawn.
        num_envs: B.
    """

    def __init__(self, arm: ArmParameters, conditions: Conditions, randomization: Randomization, num_envs: int) -> None:
        self._arm, self._conditions, self.randomization = arm, conditions, randomization
        self.nominal: dict[str, Array] = {
            **quantities(arm),
            "supply_voltage": np.asarray(conditions.supply_voltage),
            "payload": np.asarray(conditions.payload),
            "sensor_noise": np.asarray(0.0),
            "action_delay": np.asarray(0.0),
        }
        self.values: dict[str, Array] = {
            name: np.repeat(self.nominal[name][None], num_envs, axis=0) for name in (*FACTORS, *NUMBERS)
        }
        """Each (B, n) or (B,), in SI units, under the names of `Randomization`."""

    def draw(self, generators: Sequence[np.random.Generator], given: Any = None) -> dict[str, Array]:
        """Values of new arms by name, each (k, n) or (k,): drawn by each its generator, or as `given` says."""
        fixed = {} if given is None else self.randomization.given(given, self.nominal)
        drawn = [self.randomization.draw(self.nominal, generator) for generator in generators]
        return {
            name: np.stack([np.asarray(fixed.get(name, one.get(name, self.nominal[name]))) for one in drawn])
            for name in self.values
        }

    def put(self, chosen: NDArray[np.int64], values: Mapping[str, Array]) -> Array:
        """Takes over values of the chosen arms. Returns their rows for the kernel, (k, PARAMETER_ROWS, n)."""
        for name, rows in values.items():
            self.values[name][chosen] = rows
        k = len(chosen)
        every = {name: np.repeat(value[None], k, axis=0) for name, value in self.nominal.items() if value.ndim}
        every |= {name: values[name] for name in FACTORS}
        return parameter_rows(every, self._arm.gravity, self._conditions, values["payload"], values["supply_voltage"])

    @property
    def changed(self) -> bool:
        """Whether any arm's values differ from the nominal ones."""
        return any(bool((value != self.nominal[name]).any()) for name, value in self.values.items())

    def arms(self, chosen: NDArray[np.int64]) -> list[ArmParameters]:
        """The chosen arms with their own lengths, for kinematics."""
        return [
            replace(
                self._arm,
                links=tuple(
                    replace(link, length=float(length))
                    for link, length in zip(self._arm.links, self.values["length"][i], strict=True)
                ),
            )
            for i in chosen
        ]

    def copy(self) -> dict[str, Array]:
        """The values of all arms, for a state to come back to."""
        return {name: value.copy() for name, value in self.values.items()}

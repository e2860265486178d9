"""Parameters of the arms of a batch by name, and their rows for the kernel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elbow_gym.checks import as_dict, require_entries, saved_rows
from elbow_gym.parameters import ArmParameters, Array
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_rows, quantities
from elbow_gym.task.randomization import FACTORS, NUMBERS, POSITIVE, Randomization


class Population:
    """Parameters of B arms, drawn from the nominal ones at each reset.

    Args:
        arm: the nominal arm.
        conditions: load, table, friction, heat and supply; payload and supply voltage are nominal values, too.
        randomization: ranges that are drawn from.
        num_envs: B, the number of arms.
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
        """Present values of all arms in SI units, (B, n) or (B,), by the names of `Randomization`."""

    def draw(self, generators: Sequence[np.random.Generator], given: Any = None) -> dict[str, Array]:
        """Values of k new arms by name, (k, n) or (k,), each drawn by its arm's generator unless `given` has it."""
        fixed = {} if given is None else self.randomization.given(given, self.nominal)
        drawn = [self.randomization.draw(self.nominal, generator) for generator in generators]
        return {
            name: np.stack([np.asarray(fixed.get(name, one.get(name, self.nominal[name]))) for one in drawn])
            for name in self.values
        }

    def put(self, chosen: NDArray[np.int64], values: Mapping[str, Array]) -> Array:
        """Takes over values of the chosen arms, of k or of one for all; returns the values' rows for the kernel."""
        for name, rows in values.items():
            self.values[name][chosen] = rows
        return self.rows(values)

    def rows(self, values: Mapping[str, Array]) -> Array:
        """The kernel's rows of values of k arms by name, (k, PARAMETER_ROWS, n)."""
        k = len(values["payload"])
        every = {name: np.repeat(value[None], k, axis=0) for name, value in self.nominal.items() if value.ndim}
        every |= {name: values[name] for name in FACTORS}
        load, supply = values["payload"], values["supply_voltage"]
        # What is beyond float64 makes rates that the steps' check refuses.
        with np.errstate(over="ignore", invalid="ignore"):
            return parameter_rows(every, self._arm.gravity, self._conditions, load, supply)

    def checked(self, values: object, count: int) -> dict[str, Array]:
        """Values of `count` arms by name from a saved state. Raises ValueError naming one that no arm can have."""
        given = as_dict("state['parameters']", values)
        require_entries(given, self.values, "state['parameters']")
        saved = {
            name: saved_rows(f"state['parameters'][{name!r}]", given[name], own, count)
            for name, own in self.values.items()
        }
        for name, array in saved.items():
            least = array[:, 1:].min() if name == "length" else array.min()
            if least < 0.0 or (least == 0.0 and name in POSITIVE):
                rule = "be positive" if name in POSITIVE else "not be negative"
                raise ValueError(f"state['parameters'][{name!r}] must {rule}, got {least:g}")
        if saved["length"][:, 0].any():
            raise ValueError("state['parameters']['length'] must be zero for link 1, got another")
        return saved

    @property
    def changed(self) -> bool:
        """Whether any arm's values differ from the nominal ones."""
        return self.differ(self.values)

    def differ(self, values: Mapping[str, Array]) -> bool:
        """Whether any of these values of arms, by name, differ from the nominal ones."""
        return any(bool((value != self.nominal[name]).any()) for name, value in values.items())

    def arms(self, chosen: NDArray[np.int64]) -> list[ArmParameters]:
        """Parameters of the chosen arms (k,) with their drawn lengths, for kinematics."""
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
        """A copy of the values of all arms, by name."""
        return {name: value.copy() for name, value in self.values.items()}

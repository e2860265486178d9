"""What the switched-on features add to actions, observations and infos: delay, noise, contacts, heat and supply."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elbow_gym.kernel import observe
from elbow_gym.parameters import Array
from elbow_gym.simulator import Simulator
from elbow_gym.task.arm_batch import Population
from elbow_gym.task.observation import ObservationLayout
from elbow_gym.task.settings import Settings


class Extras:
    """Per-arm supply voltage, action delay and sensor noise of B arms, and what else can be seen of them.

    Args:
        settings: the environment's arguments.
        simulator: the arms.
        population: their parameters.
    """

    def __init__(self, settings: Settings, simulator: Simulator, population: Population) -> None:
        self._settings, self._simulator, self._population = settings, simulator, population
        n, arms = simulator.arm.n_joints, simulator.num_envs
        self._longest_delay = int(settings.randomization.highest("action_delay"))
        self.queue = np.zeros((arms, self._longest_delay + 1, n))
        """Voltages asked for, newest first [V], (B, 1 + longest delay, n)."""
        self._limits = simulator.arm.of_motors("temperature_limit")
        self._generators: list[np.random.Generator] = []
        self._noisy = False
        self._one = np.ones(arms)
        self.sizes = {
            "contact_force": n - 1 if settings.conditions.surface is not None else 0,
            "temperature_rise": n if settings.heat else 0,
            "pending_voltage": n * self._longest_delay,
        }
        """Entries that each optional feature adds to an observation."""
        self._switched = [name for name, size in self.sizes.items() if size]

    def check(self, values: Mapping[str, Array]) -> None:
        """Raises ValueError when an arm's actions would be later than observations make room for."""
        delay = values["action_delay"].max(initial=0.0)
        if delay > self._longest_delay:
            raise ValueError(
                f"action_delay must be at most {self._longest_delay}, the upper end of randomize's range, got {delay:g}"
            )

    def listen(self, chosen: NDArray[np.int64], generators: Sequence[np.random.Generator]) -> None:
        """The chosen arms' noise comes from these generators and is as strong as their values say from now on."""
        if not self._generators:
            self._generators = [np.random.default_rng(0)] * self._simulator.num_envs
        for i, generator in zip(chosen, generators, strict=True):
            self._generators[int(i)] = generator
        self._noisy = bool(self._population.values["sensor_noise"].any())

    def reset(self, chosen: NDArray[np.int64], generators: Sequence[np.random.Generator]) -> None:
        """The chosen arms start without voltages on their way."""
        self.queue[chosen] = 0.0
        self.listen(chosen, generators)

    def voltage(self, action: Array) -> Array:
        """Terminal voltages that arrive at the motors this control period [V], (B, n).

        Raises ValueError when an action is not a number, with nothing changed.
        """
        supply = self._population.values["supply_voltage"]
        highest, volts = (self._one, supply) if self._settings.action_unit == "fraction" else (supply, self._one)
        asked = np.empty_like(action)
        if not observe.drive(action, highest, volts, asked):
            raise ValueError(f"action must not be NaN, got {action[np.isnan(action).any(axis=1)][0].tolist()}")
        if not self._longest_delay:
            return asked
        self.queue[:, 1:] = self.queue[:, :-1].copy()
        self.queue[:, 0] = asked
        late = self._population.values["action_delay"].astype(np.int64)
        return self.queue[np.arange(len(late)), late]

    def see(
        self, layout: ObservationLayout, observation: NDArray[np.float32], resting: NDArray[np.bool_] | None
    ) -> None:
        """Fills the optional features of observations (B, size), and adds noise for arms that do not rest."""
        for name in self._switched:
            where = layout.slices[name]
            values = self._quantity(name).reshape(len(observation), -1) / layout.scale[where]
            observation[:, where] = np.clip(values, -layout.high[where], layout.high[where])
        if not self._noisy:
            return
        noise = self._population.values["sensor_noise"]
        noisy = int(layout.slices["target_angle"].start)
        for i in np.flatnonzero(noise > 0.0 if resting is None else (noise > 0.0) & ~resting):
            heard = observation[i, :noisy] + float(noise[i]) * self._generators[int(i)].standard_normal(noisy)
            observation[i, :noisy] = np.clip(heard, -layout.high[:noisy], layout.high[:noisy])

    def _quantity(self, name: str) -> Array:
        if name == "contact_force":
            return self._simulator.contact_force[..., 2]
        return self._simulator.temperature_rise if name == "temperature_rise" else self.queue[:, :-1]

    def info(self) -> dict[str, Any]:
        """Fresh arrays of what the switches add, one row per arm."""
        simulator, settings = self._simulator, self._settings
        info: dict[str, Any] = {}
        if self.sizes["contact_force"]:
            info["contact_force"] = simulator.contact_force
            info["load_bearing"] = info["contact_force"][..., 2] > 0.0
        if self.sizes["contact_force"] or settings.elbow_friction > 0.0:
            info["contact_loss"] = simulator.contact_loss.sum(axis=1)
        if settings.heat:
            info["temperature_rise"] = simulator.temperature_rise.copy()
            info["overheated"] = (simulator.temperature_rise > self._limits).any(axis=1)
        if settings.supply_resistance > 0.0:
            info["supply_loss"] = simulator.supply_loss.copy()
        return info

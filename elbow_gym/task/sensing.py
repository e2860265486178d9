"""Observations of B arms at an instant: the state's and switched-on features, noise, and the figures for infos."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elbow_gym.kernel.rows import FIGURES
from elbow_gym.motors import terminal_voltage
from elbow_gym.parameters import Array
from elbow_gym.simulator import Simulator
from elbow_gym.task.arm_batch import Population
from elbow_gym.task.observation import ObservationLayout
from elbow_gym.task.settings import Settings


class Snapshot(NamedTuple):
    """Observations of B arms at an instant, and the metrics and rewards of the control period that ends there."""

    observation: NDArray[np.float32]
    """Observations, scaled and saturated, (B, size)."""
    figures: Array
    """Rows of `FIGURES`: energies [J] and time under the table [s] since the reset, summed over the joints."""

    def figure(self, name: str) -> Array:
        """A row of the figures by name, (B,)."""
        return self.figures[FIGURES.index(name)]


def blank(num_envs: int, size: int) -> Snapshot:
    """An empty snapshot of B arms for observations of `size` entries, which the kernel fills."""
    return Snapshot(np.empty((num_envs, size), np.float32), np.empty((len(FIGURES), num_envs)))


class Sensing:
    """Entries of the switched-on features in observations and infos of B arms, and the sensors' noise.

    Args:
        settings: the environment's arguments.
        simulator: simulator of the arms.
        population: parameters of the arms.
        queue: voltages asked for, newest first [V], (B, 1 + longest delay, n).
    """

    def __init__(self, settings: Settings, simulator: Simulator, population: Population, queue: Array) -> None:
        self._settings, self._simulator, self._population, self._queue = settings, simulator, population, queue
        n = simulator.arm.n_joints
        self._limits = simulator.arm.of_motors("temperature_limit")
        self._generators: list[np.random.Generator] = []
        self._noisy = False
        self.noise: Array
        """Noise that each arm's observation was last shown with, in its units, (B, entries that have noise)."""
        sizes = {
            "contact_force": n - 1 if settings.conditions.surface is not None else 0,
            "temperature_rise": n if settings.heat else 0,
            "pending_voltage": n * (queue.shape[1] - 1),
        }
        self.silent = not (
            settings.heat or settings.conditions.surface or settings.elbow_friction or settings.supply_resistance
        )
        """Whether infos hold nothing of switched-on features, and the motors get the voltages that are asked for."""
        self._switched = [name for name, size in sizes.items() if size]
        self.layout = ObservationLayout(n, sizes, settings.task_observation)
        """The observation's entries, those of the switched-on features included."""
        self.noise = np.zeros((simulator.num_envs, self.layout.noisy.size))

    def set_noise(self, chosen: NDArray[np.int64], generators: Sequence[np.random.Generator]) -> None:
        """Sets the chosen arms' generators of noise, and its standard deviations from the arms' values."""
        if not self._generators:
            self._generators = [np.random.default_rng(0)] * self._simulator.num_envs
        for i, generator in zip(chosen, generators, strict=True):
            self._generators[int(i)] = generator
        self._noisy = bool(self._population.values["sensor_noise"].any())
        if not self._noisy:
            self.noise[:] = 0.0

    def complete(self, observation: NDArray[np.float32], resting: NDArray[np.bool_] | None) -> None:
        """Fills the switched-on features of observations (B, size), and adds noise: for arms that rest, the last."""
        layout = self.layout
        for name in self._switched:
            where = layout.slices[name]
            values = self._quantity(name).reshape(len(observation), -1) / layout.scale[where]
            observation[:, where] = np.clip(values, -layout.high[where], layout.high[where])
        if not self._noisy:
            return
        deviation = self._population.values["sensor_noise"]
        noisy = layout.noisy
        anew = np.ones(len(observation), dtype=np.bool_) if resting is None else ~resting
        self.noise[anew] = 0.0
        for i in np.flatnonzero(anew & (deviation > 0.0)):
            self.noise[i] = float(deviation[i]) * self._generators[int(i)].standard_normal(noisy.size)
        observation[:, noisy] = np.clip(observation[:, noisy] + self.noise, -layout.high[noisy], layout.high[noisy])

    def _quantity(self, name: str) -> Array:
        if name == "contact_force":
            return self._simulator.contact_force[..., 2]
        return self._simulator.temperature_rise if name == "temperature_rise" else self._queue[:, :-1]

    def terminal_voltage(self, command: Array) -> Array:
        """A fresh array of the voltages at the motors' terminals now [V], (B, n), under a command [V], (B, n)."""
        settings = self._settings
        if settings.supply_resistance == 0.0:
            return command.copy()
        supply = self._population.values["supply_voltage"], settings.supply_resistance, settings.regeneration
        return terminal_voltage(command, self._simulator.current, *supply)

    def info(self) -> dict[str, Any]:
        """Entries of infos from the switched-on features by name, new arrays with one row per arm."""
        simulator, settings = self._simulator, self._settings
        info: dict[str, Any] = {}
        if "contact_force" in self._switched:
            info["contact_force"] = simulator.contact_force
            info["load_bearing"] = info["contact_force"][..., 2] > 0.0
        if "contact_force" in self._switched or settings.elbow_friction > 0.0:
            info["contact_loss"] = simulator.contact_loss.sum(axis=1)
        if settings.heat:
            info["temperature_rise"] = simulator.temperature_rise.copy()
            info["overheated"] = (simulator.temperature_rise > self._limits).any(axis=1)
        if settings.supply_resistance > 0.0:
            info["supply_loss"] = simulator.supply_loss.copy()
        return info

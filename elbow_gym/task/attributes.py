"""Attributes that the single and the batched environment share: arguments, weights, observation names and spec."""

from __future__ import annotations

import difflib
import inspect
from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from elbow_gym.checks import non_negative
from elbow_gym.parameters import Array
from elbow_gym.task.episodes import Episodes
from elbow_gym.task.settings import Settings

WEIGHTS = ("tracking_weight", "energy_weight")
"""Arguments that may change while an environment runs."""


class TaskAttributes:
    """Attributes of an environment whose arms are in `_episodes`.

    Every argument of `Settings` can be read under its name. The two weights can be set, from the next step on. The
    others raise AttributeError when they are set, since the arms were made with them.
    """

    _episodes: Episodes
    _spec: EnvSpec | None = None

    @property
    def settings(self) -> Settings:
        """Arguments that the environment was made with."""
        return self._episodes.settings

    @property
    def episodes(self) -> Episodes:
        """Batch of the arms of this environment."""
        return self._episodes

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Name and unit of each entry of an arm's observation."""
        return self._episodes.layout.names

    def decode(self, observation: NDArray[np.float32]) -> dict[str, Array]:
        """Quantities of observations in SI units, by feature name, each (..., size)."""
        return self._episodes.layout.decode(observation)

    @property
    def energy_weight(self) -> float:
        """Cost per watt of electrical power [1/W]."""
        return self._episodes.energy_weight

    @energy_weight.setter
    def energy_weight(self, energy_weight: float) -> None:
        self.set_energy_weight(energy_weight)

    @property
    def tracking_weight(self) -> float:
        """Cost per metre of tracking error [1/m]."""
        return self._episodes.tracking_weight

    @tracking_weight.setter
    def tracking_weight(self, tracking_weight: float) -> None:
        self.set_tracking_weight(tracking_weight)

    def set_energy_weight(self, energy_weight: float) -> None:
        """Changes the cost per watt of electrical power [1/W] from the next step on."""
        self._episodes.energy_weight = non_negative("energy_weight", energy_weight)

    def set_tracking_weight(self, tracking_weight: float) -> None:
        """Changes the cost per metre of tracking error [1/m] from the next step on."""
        self._episodes.tracking_weight = non_negative("tracking_weight", tracking_weight)

    @property
    def spec(self) -> EnvSpec | None:
        """Gymnasium's specification, whose `max_episode_steps` is the number of control periods in an episode.

        `gymnasium.make` sets it; the environment ends its episodes itself, without Gymnasium's `TimeLimit`. Made anew
        from a spec, an environment keeps its length, whatever its `duration`, unless `max_episode_steps=-1` is given.
        """
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = None if spec is None else replace(spec, max_episode_steps=self._episodes.horizon)


def _fixed(name: str) -> property:
    def read(env: TaskAttributes) -> Any:
        return getattr(env.settings, name)

    def refuse(env: TaskAttributes, value: Any) -> None:
        raise AttributeError(
            f"{name} of {type(env).__name__} must be given when it is made, as {name}={value!r}; only "
            f"{' and '.join(WEIGHTS)} can be set"
        )

    return property(read, refuse, doc=f"The argument `{name}`, as it was given.")


for _field in fields(Settings):
    if _field.name not in WEIGHTS:
        setattr(TaskAttributes, _field.name, _fixed(_field.name))


def check_arguments(given: Iterable[str], constructor: Callable[..., None]) -> None:
    """Raises TypeError naming the first name that is neither an argument of `Settings` nor of the constructor.

    Args:
        given: names of the arguments that the constructor leaves to `Settings`.
        constructor: `__init__` of the environment.
    """
    named = [one.name for one in inspect.signature(constructor).parameters.values() if one.kind is not one.VAR_KEYWORD]
    allowed = sorted({*named, *(field.name for field in fields(Settings))} - {"self"})
    for name in given:
        if name not in allowed:
            close = difflib.get_close_matches(name, allowed, 1)
            perhaps = f" (perhaps {close[0]!r} is meant)" if close else ""
            raise TypeError(f"arguments must be among {allowed}, got {name!r}{perhaps}")

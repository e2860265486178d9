"""Parameters and circles that arms have drawn, as infos tell them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from elbow_gym.task.arm_batch import Population
from elbow_gym.task.infos import of_arm
from elbow_gym.task.settings import Settings
from elbow_gym.task.targets import Targets


class Copies(dict[str, Any]):
    """Copies of a dict's arrays, made when somebody looks for them: sixteen of them cost a fifth of a step."""

    source: Mapping[str, Any] | None = None
    """The dict, which stays as it is; None once the copies are made."""

    def make(self) -> None:
        """Makes the copies, if they have not been made."""
        source, self.source = self.source, None
        if source is not None:
            dict.update(self, {name: np.copy(value) if value.ndim else value for name, value in source.items()})

    def __reduce__(self) -> tuple[Any, ...]:
        return Copies, (dict(self),)


def _looking(name: str) -> Any:
    method = getattr(dict, name)

    def look(self: Copies, *args: Any, **kwargs: Any) -> Any:
        self.make()
        return method(self, *args, **kwargs)

    look.__name__, look.__doc__ = name, method.__doc__
    return look


# All that a dict answers or does, `__iter__` included: with a dict's own one, dict() would look past it.
for _name in (
    *("__contains__", "__delitem__", "__eq__", "__getitem__", "__ior__", "__iter__", "__len__", "__ne__", "__or__"),
    *("__repr__", "__reversed__", "__ror__", "__setitem__", "clear", "copy", "get", "items", "keys", "pop", "popitem"),
    *("setdefault", "update", "values"),
):
    setattr(Copies, _name, _looking(_name))


class Draws:
    """What infos tell of the draws of B arms: nothing where no arm has drawn, or was given, what others have not.

    Args:
        settings: the environment's arguments.
        population: parameters of the arms.
        targets: their targets.
    """

    def __init__(self, settings: Settings, population: Population, targets: Targets) -> None:
        self._population, self._targets = population, targets
        self.starts = np.zeros((len(targets.path), settings.parsed_arm.n_joints))
        """Start poses [rad], (B, n), told where they are spread."""
        self._circles, self._spread = settings.parsed_circle.random, settings.start_spread > 0.0
        self.renew()

    def renew(self) -> None:
        """Takes over new parameters and circles of the arms."""
        self._parameters = bool(self._population.randomization.ranges) or self._population.changed
        self._kept: dict[int, dict[str, dict[str, Any]]] = {}

    def tell(self, info: dict[str, Any], arm: int | slice) -> None:
        """Puts dicts of parameters, circle and start into an info: rows of all arms, or what is one arm's."""
        if not (self._parameters or self._circles or self._spread):
            return
        if isinstance(arm, slice):
            info.update(self._rows())
            return
        if arm not in self._kept:
            self._kept[arm] = of_arm(self._rows(), arm)
        for name, source in self._kept[arm].items():
            info[name] = copies = Copies()
            copies.source = source

    def _rows(self) -> dict[str, dict[str, Any]]:
        rows: dict[str, dict[str, Any]] = {}
        if self._parameters:
            rows["parameters"] = self._population.copy()
        if self._circles:
            rows["circle"] = self._targets.figures()
        if self._spread:
            rows["start"] = {"q": self.starts.copy()}
        return rows

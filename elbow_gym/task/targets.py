"""Targets of B arms: each arm's circle or other path, and how fast its target runs along it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from elbow_gym.checks import as_dict, require_entries
from elbow_gym.kernel.rows import AHEAD, ANGLE_RATE, NORMAL, PHASE, RADIUS, TASK_COLUMNS, TURN
from elbow_gym.parameters import Array
from elbow_gym.task.circle import Circle, as_angle
from elbow_gym.task.observation import LOOKAHEAD


class Targets:
    """One target per arm.

    Args:
        circle: path, or ranges from which one is drawn for each arm at its reset.
        task: the kernel's columns of what the arms are to do, (B, TASK_COLUMNS); these are kept up to date here:
            the targets' angle at the reset, how far they turn, and the circles where the task is observed.
        control_period: time between two actions [s].
    """

    def __init__(self, circle: Circle, task: Array, control_period: float) -> None:
        num_envs = len(task)
        self._period = control_period
        first = circle.draw(np.random.default_rng(0))
        self.circles: list[Circle] = [first] * num_envs
        """Each arm's circle, as drawn at its last reset."""
        self.path = np.repeat(first.path[None], num_envs, axis=0)
        """Each arm's path as Fourier rows [m], (B, rows, 3)."""
        self._rate = np.full(num_envs, first.rate)
        self._figures = {name: np.empty(num_envs) for name in ("radius", "period", "tilt", "tilt_axis")}
        self._task = task
        self._measure(range(num_envs))
        self._pace()
        self._alike = not circle.random

    def _pace(self) -> None:
        """Updates the targets' turns in a control period, and to the look-ahead target [rad], each (B,)."""
        self._task[:, TURN], self._task[:, AHEAD] = self._rate * self._period, self._rate * LOOKAHEAD

    def _measure(self, chosen: Iterable[int]) -> None:
        """Figures of the chosen arms' circles, for infos and, where the task is observed, for observations."""
        observed = self._task.shape[1] > TASK_COLUMNS
        for i in chosen:
            circle = self.circles[i]
            for name, figures in self._figures.items():
                figures[i] = getattr(circle, name)
            if observed:
                self._task[i, RADIUS], self._task[i, ANGLE_RATE] = self._figures["radius"][i], circle.rate
                self._task[i, NORMAL : NORMAL + 3] = circle.normal

    def draw(self, circle: Circle, generators: Sequence[np.random.Generator], phase: object = None) -> list[Circle]:
        """New circles, each by its arm's generator, which start at `phase` [rad] if it is given.

        A given phase is not drawn, whatever else is.
        """
        if phase is not None:
            circle = Circle.from_dict({**circle.to_dict(), "phase": as_angle("phase", phase)})
        return [circle.draw(generator) for generator in generators]

    def check(self, circles: Sequence[Circle]) -> None:
        """Raises ValueError unless the circles' paths have as many rows as those of the batch."""
        rows = self.path.shape[1]
        for circle in circles:
            if circle.path_rows != rows:
                raise ValueError(f"circle must have a shape of {rows} path rows, got one of {circle.path_rows}")

    def put(self, chosen: NDArray[np.int64], circles: Sequence[Circle]) -> None:
        """Gives the chosen arms new circles, which `check` has passed."""
        for i, circle in zip(chosen, circles, strict=True):
            self._alike = self._alike and bool((circle.path == self.circles[0].path).all())
            self.circles[int(i)] = circle
            self.path[i], self._rate[i], self._task[i, PHASE] = circle.path, circle.rate, float(circle.phase)
        self._measure(map(int, chosen))
        self._pace()

    def angle(self, steps: NDArray[np.int64]) -> Array:
        """Angle of each target on its path after `steps` control periods [rad], (B,)."""
        return self._task[:, PHASE] + self._task[:, TURN] * steps

    def position(self, angle: Array) -> Array:
        """Each target's position at its angle [m], (B, 3)."""
        if self._alike:
            return self.circles[0].position(angle)
        return np.stack([circle.position(one) for circle, one in zip(self.circles, angle, strict=True)])

    def velocity(self, angle: Array) -> Array:
        """Each target's velocity at its angle [m/s], (B, 3)."""
        if self._alike and (self._rate == self._rate[0]).all():
            return self.circles[0].velocity(angle)
        return np.stack([circle.velocity(one) for circle, one in zip(self.circles, angle, strict=True)])

    @property
    def rate(self) -> Array:
        """Signed rate of each target's angle [rad/s], (B,)."""
        return self._rate.copy()

    def get_state(self) -> dict[str, Any]:
        """The circles of all arms, from which paths, rates and phases follow."""
        return {"circles": list(self.circles)}

    def checked(self, state: object, count: int) -> list[Circle]:
        """The circles of `count` arms from a saved state. Raises ValueError where they are not drawn or do not fit."""
        given = as_dict("state['targets']", state)
        require_entries(given, ("circles",), "state['targets']")
        circles = given["circles"]
        if not isinstance(circles, list) or not all(
            isinstance(one, Circle) and not one.drawn for one in cast("list[object]", circles)
        ):
            raise ValueError(f"state['targets']['circles'] must be a list of drawn circles, got {circles!r}")
        drawn = cast("list[Circle]", circles)
        if len(drawn) != count:
            raise ValueError(f"state['targets']['circles'] must have {count} entries, got {len(drawn)}")
        self.check(drawn)
        return drawn

    def figures(self) -> dict[str, Array]:
        """Centre [m] (B, 3) and, (B,), radius [m], period [s], tilt, its axis and phase [rad], signed rate [rad/s]."""
        return {
            "center": self.path[:, 0].copy(),
            **{name: figures.copy() for name, figures in self._figures.items()},
            "phase": self._task[:, PHASE].copy(),
            "rate": self._rate.copy(),
        }

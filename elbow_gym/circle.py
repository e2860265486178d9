"""The target: a circle in space as a pure function of its angle, and the angle of time."""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym import kernel
from elbow_gym.parameters import ArmParameters, Array, positive

PLANES = ("xy", "xz", "yz", "radial")
DIRECTIONS = ("counterclockwise", "clockwise")


@dataclass(frozen=True, kw_only=True)
class Circle:
    """The circle that the hand should follow; the defaults are the paper's.

    The angle grows from the plane's first axis to its second: x to y (counterclockwise seen from +z), x to z,
    y to z, or, in the radial plane through the z axis and the centre, outward to up.
    """

    center: tuple[float, float, float] = (1.5, 1.5, 0.4)
    """Centre [m] in world x, y, z."""
    radius: float = 0.1
    """Radius [m]."""
    period: float = 5.0
    """Time of one turn [s]."""
    plane: str = "xy"
    """"xy", "xz", "yz" or "radial"."""
    phase: float | str = 0.0
    """Angle at time zero [rad], or "random": drawn anew at each reset."""
    direction: str = "counterclockwise"
    """"counterclockwise" or "clockwise"."""

    def __post_init__(self) -> None:
        center = self.center
        if not isinstance(center, list | tuple | np.ndarray) or len(center) != 3:
            raise ValueError(f"circle center must have three coordinates, got {center!r}")
        if not all(isinstance(value, numbers.Real) for value in center):
            raise ValueError(f"circle center must be three numbers, got {center!r}")
        if not all(math.isfinite(value) for value in center):
            raise ValueError(f"circle center must be finite, got {center!r}")
        object.__setattr__(self, "center", tuple(float(value) for value in center))
        object.__setattr__(self, "radius", positive("circle radius", self.radius))
        object.__setattr__(self, "period", positive("circle period", self.period))
        if self.plane not in PLANES:
            raise ValueError(f"circle plane must be one of {PLANES}, got {self.plane!r}")
        if self.direction not in DIRECTIONS:
            raise ValueError(f"circle direction must be one of {DIRECTIONS}, got {self.direction!r}")
        if isinstance(self.phase, str):
            if self.phase != "random":
                raise ValueError(f'circle phase must be an angle in rad or "random", got {self.phase!r}')
        else:
            object.__setattr__(self, "phase", as_phase(self.phase))

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Circle:
        """A circle from a dict of its fields, the paper's where one is missing. ValueError on an unknown one."""
        allowed = {field.name for field in fields(cls)}
        unknown = sorted(set(plain) - allowed)
        if unknown:
            raise ValueError(f"circle must have only the entries {sorted(allowed)}, got {unknown[0]!r}")
        return cls(**plain)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON types, the inverse of `from_dict`."""
        return {**asdict(self), "center": list(self.center)}

    @property
    def rate(self) -> float:
        """Signed rate of the angle [rad/s]."""
        return (2.0 if self.direction == "counterclockwise" else -2.0) * math.pi / self.period

    def _axes(self) -> tuple[Array, Array]:
        if self.plane == "radial":
            x, y, _ = self.center
            rho = math.hypot(x, y)
            first = np.array([x / rho, y / rho, 0.0]) if rho > 0.0 else np.array([1.0, 0.0, 0.0])
            return first, np.array([0.0, 0.0, 1.0])
        unit = np.eye(3)
        return unit["xyz".index(self.plane[0])], unit["xyz".index(self.plane[1])]

    def angle(self, time: ArrayLike, phase: ArrayLike) -> Array:
        """Angle of the target on the circle [rad] at a time [s], starting from `phase` [rad]."""
        return np.asarray(phase, dtype=np.float64) + self.rate * np.asarray(time, dtype=np.float64)

    @cached_property
    def path(self) -> Array:
        """Fourier rows of the path [m], (3, 3): the centre, then what the angle's cosine and sine multiply."""
        first, second = self._axes()
        return np.array([self.center, self.radius * first, self.radius * second])

    def position(self, angle: ArrayLike) -> Array:
        """Target position r_d [m], shape (..., 3), at an angle [rad], shape (...).   Eq. 28."""
        return _points(self.path, angle)

    @cached_property
    def _path_rate(self) -> Array:
        _, cosine, sine = self.path
        return np.array([np.zeros(3), self.rate * sine, -self.rate * cosine])

    def velocity(self, angle: ArrayLike) -> Array:
        """Target velocity [m/s], shape (..., 3), at an angle [rad], shape (...)."""
        return _points(self._path_rate, angle)


def _points(path: Array, angle: ArrayLike) -> Array:
    angle = np.asarray(angle, dtype=np.float64)
    points = np.empty((angle.size, 3))
    kernel.path(path, angle.ravel(), points)
    return points.reshape(*angle.shape, 3)


def as_phase(phase: object) -> float:
    """A phase [rad] as a float; ValueError unless it is a finite number."""
    if isinstance(phase, bool) or not isinstance(phase, numbers.Real):
        raise ValueError(f"phase must be an angle in rad, got {phase!r}")
    if not math.isfinite(phase):
        raise ValueError(f"phase must be finite, got {phase!r}")
    # The target needs the angle alone; whole turns would cost it digits.
    return math.remainder(phase, 2.0 * math.pi) if abs(float(phase)) > 1e3 else float(phase)


def as_circle(circle: object) -> Circle:
    """A circle from None (the paper's), a dict of its fields, or a Circle."""
    if circle is None:
        return Circle()
    if isinstance(circle, Circle):
        return circle
    if isinstance(circle, Mapping):
        return Circle.from_dict(cast("Mapping[str, Any]", circle))
    raise ValueError(f"circle must be a dict of its fields or None, got {circle!r}")


def reach_shortfall(arm: ArmParameters, elbows: Sequence[int], position: ArrayLike) -> Array:
    """By how much points [m], shape (..., 3), lie outside the hand's reach [m], shape (...); at most 0 inside.

    The last elbow may lie anywhere on the table within its links' length; the rest of the arm starts there.
    """
    position = np.asarray(position, dtype=np.float64)
    length = arm.of_links("length")
    bend = elbows[-1] - 1 if len(elbows) else 0
    table, free = length[:bend].sum(), length[bend:]
    rho = np.hypot(position[..., 0], position[..., 1])
    distance = np.hypot(np.maximum(rho - table, 0.0), position[..., 2])
    shortfall = distance - free.sum()
    if not len(elbows):
        # One link longer than all the others together leaves a hole around the base.
        shortfall = np.maximum(shortfall, 2.0 * free.max() - free.sum() - distance)
    return shortfall


def check_reachable(arm: ArmParameters, elbows: Sequence[int], circle: Circle) -> None:
    """Raises ValueError, with the distance missing, when a point of the circle is out of the hand's reach."""
    points = circle.position(np.linspace(0.0, 2.0 * np.pi, 361))
    shortfall = reach_shortfall(arm, elbows, points)
    worst = int(shortfall.argmax())
    if shortfall[worst] > 0.0:
        point = tuple(round(float(value), 4) for value in points[worst])
        raise ValueError(
            f"circle must lie within the hand's reach, got the point {point} {shortfall[worst]:.4g} m outside"
        )

"""Closed path of the target, a circle by default, as a function of its angle, and the angle at a time."""

from __future__ import annotations

import math
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.checks import check_entries, finite, is_finite, positive
from elbow_gym.kernel.path import path as points_of
from elbow_gym.parameters import Array
from elbow_gym.task.fourier_path import (
    PLANES,
    Point,
    as_plane,
    as_shape,
    circle_path,
    figure_eight_path,
    path_rate,
    plane_axes,
    plane_normal,
    points_path,
    tilted_axes,
)
from elbow_gym.task.ranges import Range, as_range, draw_number, ends, is_pair

DIRECTIONS = ("counterclockwise", "clockwise")
PLACING = ("center", "radius", "plane", "tilt", "tilt_axis")
"""Fields that say where the path is, unless it is given by points."""


@dataclass(frozen=True, kw_only=True)
class Circle:
    """The circle, or other closed path, that the hand should follow; the defaults are the paper's.

    The angle grows from the plane's first axis to its second: x to y (counterclockwise from above), x to z,
    y to z, or, in the radial plane through the z axis and the centre, outward to up.

    A quantity given as a range, as several planes or as "random" is drawn anew at each reset (`draw`); until then the
    circle has no path. Raises ValueError naming the field.
    """

    center: tuple[Range, Range, Range] = (1.5, 1.5, 0.4)
    """Centre [m] in world x, y, z, each a number or (low, high)."""
    radius: Range = 0.1
    """Radius [m], or (low, high); of the figure-eight half its width."""
    period: Range = 5.0
    """Time of one turn [s], or (low, high)."""
    plane: str | tuple[str, ...] = "xy"
    """Plane: "xy", "xz", "yz" or "radial"; several of these to draw from, or "random" for any."""
    tilt: Range = 0.0
    """Angle by which the plane is turned about a line in it through the centre [rad], at most a right one, or (low,
    high)."""
    tilt_axis: float | str = 0.0
    """Angle from the plane's first axis to that line [rad], or "random"."""
    phase: float | str = 0.0
    """Angle at time zero [rad], or "random"."""
    direction: str = "counterclockwise"
    """Sense of rotation: "counterclockwise", "clockwise" or "random"."""
    shape: str | tuple[Point, ...] = "circle"
    """"circle", "figure_eight", or points [m] in world x, y, z, passed at equal steps of the angle in their order.

    Between the points the path is their trigonometric interpolation; its centre is their mean, and centre, radius and
    plane have no say."""

    def __post_init__(self) -> None:
        checked = {
            "center": _center(self.center),
            "radius": as_range("circle radius", self.radius, positive),
            "period": as_range("circle period", self.period, positive),
            "plane": as_plane(self.plane),
            "tilt": as_range("circle tilt", self.tilt, _tilt),
            "tilt_axis": _angle("tilt_axis", self.tilt_axis),
            "phase": _angle("phase", self.phase),
            "shape": as_shape(self.shape),
        }
        if not isinstance(self.direction, str) or self.direction not in (*DIRECTIONS, "random"):  # pyright: ignore
            raise ValueError(f'circle direction must be one of {DIRECTIONS} or "random", got {self.direction!r}')
        for name, value in checked.items():
            object.__setattr__(self, name, value)
        unused = [name for name in self.drawn if name in PLACING]
        if unused and not isinstance(self.shape, str):
            raise ValueError(
                f"circle {unused[0]} must not be random where the shape is given by points, "
                f"got {getattr(self, unused[0])!r}"
            )

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Circle:
        """A circle from a dict of its fields, the paper's where one is missing. ValueError on an unknown one."""
        check_entries(plain, {field.name for field in fields(cls)}, "circle")
        return cls(**plain)

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON types, the inverse of `from_dict`."""
        return {field.name: _listed(getattr(self, field.name)) for field in fields(self)}

    @property
    def drawn(self) -> tuple[str, ...]:
        """Names of the fields that `draw` draws, in its order."""
        order = ("center", "radius", "period", "plane", "tilt", "tilt_axis", "direction", "phase")
        return tuple(name for name in order if _is_random(name, getattr(self, name)))

    @property
    def random(self) -> bool:
        """Whether anything but the phase is drawn at each reset."""
        return any(name != "phase" for name in self.drawn)

    def draw(self, generator: np.random.Generator) -> Circle:
        """A circle with everything fixed, the phase included.

        Draws in this order, and only what is random: x, y and z of the centre, radius, period, plane, tilt, tilt_axis,
        direction, phase. Each takes one draw: `uniform(low, high)`, `integers` of the planes or directions, and of the
        other angles `uniform(-pi, pi)`.
        """
        values: dict[str, Any] = {}
        for name in self.drawn:
            value = getattr(self, name)
            if name == "center":
                values[name] = tuple(draw_number(coordinate, generator) for coordinate in value)
            elif name in ("radius", "period", "tilt"):
                values[name] = draw_number(value, generator)
            elif name in ("phase", "tilt_axis"):
                values[name] = generator.uniform(-np.pi, np.pi)
            else:
                choices = self.planes if name == "plane" else DIRECTIONS
                values[name] = choices[generator.integers(len(choices))]
        return replace(self, **values) if values else self

    @property
    def widest(self) -> Circle:
        """The largest circle, else in the middle of the ranges: first plane, counterclockwise from angle zero."""
        choices = {"plane": self.planes[0], "direction": DIRECTIONS[0], "tilt_axis": 0.0, "phase": 0.0}
        means = {"center": tuple(float(np.mean(ends(x))) for x in self.center)}
        means |= {name: float(np.mean(ends(getattr(self, name)))) for name in ("period", "tilt")}
        means["radius"] = ends(self.radius)[-1]
        return replace(self, **{name: {**choices, **means}[name] for name in self.drawn})

    @property
    def planes(self) -> tuple[str, ...]:
        """The planes that the circle may lie in."""
        if isinstance(self.plane, tuple):
            return self.plane
        return PLANES if self.plane == "random" else (self.plane,)

    def _fixed(self, name: str) -> Any:
        value = getattr(self, name)
        if _is_random(name, value):
            raise ValueError(f"circle {name} must be drawn first, got {value!r}")
        return value

    @property
    def rate(self) -> float:
        """Signed rate of the angle [rad/s]."""
        return (2.0 if self._fixed("direction") == "counterclockwise" else -2.0) * math.pi / self._fixed("period")

    def angle(self, time: ArrayLike, phase: ArrayLike) -> Array:
        """Angle of the target on the circle [rad] at a time [s], starting from `phase` [rad]."""
        return np.asarray(phase, dtype=np.float64) + self.rate * np.asarray(time, dtype=np.float64)

    @property
    def path_rows(self) -> int:
        """Rows of the path: 3 of a circle, 5 of a figure-eight, 1 + 2 floor(m / 2) of m points."""
        if isinstance(self.shape, tuple):
            return 1 + len(self.shape) // 2 * 2
        return 3 if self.shape == "circle" else 5

    @cached_property
    def path(self) -> Array:
        """Fourier rows of the path [m], (path_rows, 3): the centre, then what cos a, sin a, cos 2a, ... multiply.

        ValueError while one of `PLACING` is still to be drawn.
        """
        if isinstance(self.shape, tuple):
            return points_path(self.shape)
        center, radius = self._fixed("center"), self._fixed("radius")
        of_shape = circle_path if self.shape == "circle" else figure_eight_path
        return of_shape(center, radius, self._axes)

    @cached_property
    def _axes(self) -> tuple[Array, Array]:
        """Unit vectors at the angles zero and a quarter turn, each (3,)."""
        plane, center, tilt, axis = (self._fixed(name) for name in ("plane", "center", "tilt", "tilt_axis"))
        axes = plane_axes(plane, center)
        return axes if tilt == 0.0 else tilted_axes(axes, tilt, axis)

    @property
    def normal(self) -> Array:
        """Unit normal of the plane, about which the angle grows by the right-hand rule, (3,)."""
        return plane_normal(self._axes)

    def position(self, angle: ArrayLike) -> Array:
        """Target position r_d [m], shape (..., 3), at an angle [rad], shape (...).   Eq. 28."""
        return _points(self.path, angle)

    @cached_property
    def _path_rate(self) -> Array:
        return path_rate(self.path, self.rate)

    def velocity(self, angle: ArrayLike) -> Array:
        """Target velocity [m/s], shape (..., 3), at an angle [rad], shape (...)."""
        return _points(self._path_rate, angle)


def _points(path: Array, angle: ArrayLike) -> Array:
    angle = np.asarray(angle, dtype=np.float64)
    points = np.empty((angle.size, 3))
    points_of(path, angle.ravel(), points)
    return points.reshape(*angle.shape, 3)


def _center(center: object) -> tuple[Range, Range, Range]:
    if isinstance(center, np.ndarray):
        center = cast("object", center.tolist())
    if not isinstance(center, list | tuple) or len(cast("Sequence[object]", center)) != 3:
        raise ValueError(f"circle center must have three coordinates, got {center!r}")
    listed = cast("Sequence[Any]", center)
    bounds = [end for coordinate in listed for end in (coordinate if is_pair(coordinate) else (coordinate,))]
    if not all(isinstance(end, numbers.Real) for end in bounds):
        raise ValueError(f"circle center must be three numbers or pairs [low, high], got {center!r}")
    if not all(is_finite(end) for end in bounds):
        raise ValueError(f"circle center must be finite, got {center!r}")
    x, y, z = (as_range("circle center", coordinate, finite) for coordinate in listed)
    return x, y, z


def _tilt(name: str, tilt: object) -> float:
    angle = finite(name, tilt)
    if abs(angle) > math.pi / 2.0:
        raise ValueError(f"{name} must be at most a right angle (1.5708 rad) either way, got {angle:g}")
    return angle


def _angle(name: str, angle: object) -> float | str:
    if not isinstance(angle, str):
        return as_angle(name, angle)
    if angle != "random":
        raise ValueError(f'circle {name} must be an angle in rad or "random", got {angle!r}')
    return angle


def _is_random(name: str, value: Any) -> bool:
    if name == "center":
        return any(isinstance(coordinate, tuple) for coordinate in value)
    return isinstance(value, tuple) or value == "random"


def _listed(value: Any) -> Any:
    return [_listed(entry) for entry in cast("Sequence[Any]", value)] if isinstance(value, tuple) else value


def as_angle(name: str, given: object) -> float:
    """An angle [rad] as a float; ValueError naming it unless it is a finite number."""
    if isinstance(given, bool) or not isinstance(given, numbers.Real):
        raise ValueError(f"{name} must be an angle in rad, got {given!r}")
    angle = finite(name, given)
    # The target needs the angle alone; whole turns would cost it digits.
    return math.remainder(angle, 2.0 * math.pi) if abs(angle) > 1e3 else angle


def as_circle(circle: object) -> Circle:
    """A circle from None (the paper's), a dict of its fields, or a Circle."""
    if circle is None:
        return Circle()
    if isinstance(circle, Circle):
        return circle
    if isinstance(circle, Mapping):
        return Circle.from_dict(cast("Mapping[str, Any]", circle))
    raise ValueError(f"circle must be a dict of its fields or None, got {circle!r}")

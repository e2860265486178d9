"""Closed paths in space as Fourier series of an angle a, (rows, 3): rows 1, cos a, sin a, cos 2a, sin 2a, ..."""

from __future__ import annotations

import math
import numbers
from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.checks import is_finite
from elbow_gym.parameters import Array

Point = tuple[float, float, float]

PLANES = ("xy", "xz", "yz", "radial")
SHAPES = ("circle", "figure_eight")
FURTHEST = 1e100
"""Largest coordinate of a path's point [m], beyond any arm's reach: sums of larger ones can overflow."""


def as_plane(plane: object) -> str | tuple[str, ...]:
    """A plane's name, "random", or names of planes to draw from. Raises ValueError on anything else."""
    if isinstance(plane, str) and plane in (*PLANES, "random"):
        return plane
    if isinstance(plane, list | tuple) and plane:
        names = tuple(name for name in cast("Sequence[object]", plane) if isinstance(name, str) and name in PLANES)
        if len(names) == len(cast("Sequence[object]", plane)):
            return names
    raise ValueError(f'circle plane must be one of {PLANES}, a list of them or "random", got {plane!r}')


def as_shape(shape: object) -> str | tuple[Point, ...]:
    """A shape's name, or three or more points of a path [m]. Raises ValueError on anything else."""
    if isinstance(shape, str) and shape in SHAPES:
        return shape
    if isinstance(shape, np.ndarray):
        shape = cast("object", shape.tolist())
    if not isinstance(shape, list | tuple):
        raise ValueError(f"circle shape must be one of {SHAPES} or a list of points, got {shape!r}")
    points = cast("Sequence[object]", shape)
    if len(points) < 3:
        raise ValueError(f"circle shape must have at least 3 points, got {len(points)}")
    checked = tuple(_as_point(point) for point in points)
    far = max(abs(coordinate) for point in checked for coordinate in point)
    if far > FURTHEST:
        raise ValueError(f"circle shape must have coordinates of at most {FURTHEST:g} m, got {far:g}")
    return checked


def _as_point(point: object) -> Point:
    if isinstance(point, np.ndarray):
        point = cast("object", point.tolist())
    if isinstance(point, list | tuple):
        entries = cast("Sequence[object]", point)
        if len(entries) == 3 and all(isinstance(entry, numbers.Real) and is_finite(entry) for entry in entries):
            x, y, z = (float(cast("float", entry)) for entry in entries)
            return x, y, z
    raise ValueError(f"circle shape must have points of three finite numbers, got {point!r}")


def plane_axes(plane: str, center: Sequence[float]) -> tuple[Array, Array]:
    """First and second unit vector of a plane, each (3,); "radial" is the upright one through z axis and centre."""
    if plane == "radial":
        x, y, _ = center
        rho = math.hypot(x, y)
        first = np.array([x / rho, y / rho, 0.0]) if rho > 0.0 else np.array([1.0, 0.0, 0.0])
        return first, np.array([0.0, 0.0, 1.0])
    unit = np.eye(3)
    return unit["xyz".index(plane[0])], unit["xyz".index(plane[1])]


def plane_normal(axes: tuple[Array, Array]) -> Array:
    """Unit normal of a plane with these unit vectors, first times second, (3,)."""
    (a, b, c), (d, e, f) = axes[0].tolist(), axes[1].tolist()
    # A tenth of the time of np.cross.
    return np.array([b * f - c * e, c * d - a * f, a * e - b * d])


def tilted_axes(axes: tuple[Array, Array], tilt: float, tilt_axis: float) -> tuple[Array, Array]:
    """The axes of a plane after a turn by `tilt` [rad] about the line in it at the angle `tilt_axis` [rad]."""
    first, second = axes
    c, s = math.cos(tilt_axis), math.sin(tilt_axis)
    line = c * first + s * second
    across = math.cos(tilt) * (c * second - s * first) + math.sin(tilt) * plane_normal(axes)
    return c * line - s * across, s * line + c * across


def circle_path(center: Sequence[float], radius: float, axes: tuple[Array, Array]) -> Array:
    """Rows of center + radius (first cos a + second sin a) [m], (3, 3)."""
    first, second = axes
    return np.array([center, radius * first, radius * second])


def figure_eight_path(center: Sequence[float], radius: float, axes: tuple[Array, Array]) -> Array:
    """Rows of center + radius (first cos a + second sin 2a / 2) [m], (5, 3): a lying eight, `radius` its half width.

    It starts where the circle of this radius does, in the same direction and at the same speed.
    """
    first, second = axes
    zero = np.zeros(3)
    return np.array([center, radius * first, zero, zero, radius / 2.0 * second])


def points_path(points: ArrayLike) -> Array:
    """Rows of the path [m] that passes the m points (m, 3) at a = 2 pi j / m: trigonometric interpolation.

    Shape (1 + 2 floor(m / 2), 3). Of the highest wave an even number of points tells the cosine alone.
    """
    points = np.asarray(points, dtype=np.float64)
    m = len(points)
    spectrum = np.fft.rfft(points, axis=0) / m
    rows = np.empty((2 * len(spectrum) - 1, 3))
    rows[0] = spectrum[0].real
    rows[1::2], rows[2::2] = 2.0 * spectrum[1:].real, -2.0 * spectrum[1:].imag
    if m % 2 == 0:
        rows[-2], rows[-1] = spectrum[-1].real, 0.0
    return rows


def path_rate(path: Array, rate: float) -> Array:
    """Rows of the path's derivative to time [m/s], of the path's shape, where the angle grows at `rate` [rad/s]."""
    order = rate * np.arange(1.0, len(path) // 2 + 1)[:, None]
    derivative = np.zeros_like(path)
    derivative[1::2], derivative[2::2] = order * path[2::2], -order * path[1::2]
    return derivative

"""Reach of the hand: how far a point, or a path that may be drawn, lies outside of it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.parameters import ArmParameters, Array
from elbow_gym.task.circle import PLACING, Circle
from elbow_gym.task.ranges import ends


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
    """Raises ValueError, with the distance missing, when a point of the path is out of the hand's reach.

    Covers every circle that may be drawn. Where lengths are random too, give the arm with the shortest ones.
    """
    points = extreme_points(circle)
    shortfall = reach_shortfall(arm, elbows, points)
    worst = int(shortfall.argmax())
    if shortfall[worst] > 0.0:
        point = tuple(round(float(value), 4) for value in points[worst])
        what = "circle" if circle.shape == "circle" else "path"
        raise ValueError(
            f"{what} must lie within the hand's reach, got the point {point} {shortfall[worst]:.4g} m outside"
        )


@lru_cache(maxsize=64)
def extreme_points(circle: Circle) -> Array:
    """Points (m, 3) that are out of reach whenever a point of any circle that may be drawn is; read-only.

    Outward the shortfall is convex in the point, and the point affine in the centre (in the radial plane: in its height
    and its distance from the axis, itself convex), so that the worst centre is a corner of its box; the worst radius is
    the largest, because circles and eights are symmetric about their centre; and drawn tilts are covered by some, with
    a radius that is larger by up to 2 %. A hole around the base is not convex: the last point represents it, the
    nearest one of a box around all circles, which may refuse a set that just misses it.
    """
    # No wave of the path goes by with fewer than 45 samples.
    angle = np.linspace(0.0, 2.0 * np.pi, 1 + 45 * max(8, circle.path_rows // 2))
    if not set(PLACING) & set(circle.drawn):
        return _kept(circle.position(angle))
    bounds, radius = [ends(coordinate) for coordinate in circle.center], ends(circle.radius)[-1]
    tilts, axes, wider = _tilts(circle)
    corners = [
        replace(circle, center=center, radius=wider * radius, plane=plane, tilt=tilt, tilt_axis=axis).position(angle)
        for center in itertools.product(*bounds)
        for plane in circle.planes
        for tilt in tilts
        for axis in axes
    ]
    sides = ["xyz" if any(ends(circle.tilt)) or plane == "radial" else plane for plane in circle.planes]
    spread = radius * np.array([any(axis in side for side in sides) for axis in "xyz"])
    nearest = np.clip(0.0, [low for low, *_ in bounds] - spread, [high for *_, high in bounds] + spread)
    return _kept(np.concatenate([*corners, nearest[None]]))


def _kept(points: Array) -> Array:
    points.flags.writeable = False
    return points


def _tilts(circle: Circle) -> tuple[list[float], list[float | str], float]:
    """Tilts and their axes [rad] whose circles have every drawn one in their hull, with a radius so much larger [-]."""
    if circle.tilt_axis == "random":
        # Turned about every axis, circles of the largest tilt pass through the points of all smaller ones.
        tilts, axes = [max(map(abs, ends(circle.tilt)))], np.linspace(0.0, np.pi, 12, endpoint=False).tolist()
        axes = [*axes, *(axis + np.pi for axis in axes)]
        step = np.pi / 12.0
    else:
        tilts, axes = np.linspace(ends(circle.tilt)[0], ends(circle.tilt)[-1], 9).tolist(), [circle.tilt_axis]
        step = (tilts[-1] - tilts[0]) / 8.0
    if not {"tilt", "tilt_axis"} & set(circle.drawn):
        return tilts[:1], axes, 1.0
    return tilts, axes, 1.0 / math.cos(step / 2.0)

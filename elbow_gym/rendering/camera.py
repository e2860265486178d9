"""Pinhole camera as a pure function from world points to pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.parameters import Array

ELEVATION = math.radians(27.0)
"""Angle of the camera below the horizontal [rad]."""
VIEW_ANGLE = math.radians(34.0)
"""Angle between the left and the right edge of the framed part of the picture [rad]."""


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Position, direction and scale of a camera."""

    eye: Array
    """Position of the camera [m], (3,)."""
    axes: Array
    """Unit vectors of the picture's right, up and into the picture, rows of (3, 3)."""
    focal_length: float
    """Pixels per unit of tangent."""
    centre: tuple[float, float]
    """Pixel on the camera's axis (x right, y down)."""

    def project(self, points: ArrayLike) -> Array:
        """Pixels (..., 2), x right and y down from the upper left corner, of world points [m], (..., 3).

        Points behind the camera are projected as if they were just before it.
        """
        local = (np.asarray(points, dtype=np.float64) - self.eye) @ self.axes.T
        scale = self.focal_length / np.maximum(local[..., 2], 1e-3)
        x, y = self.centre
        return np.stack([x + scale * local[..., 0], y - scale * local[..., 1]], axis=-1)

    def depth(self, points: ArrayLike) -> Array:
        """Distance into the picture [m], (...), of world points [m], (..., 3)."""
        return (np.asarray(points, dtype=np.float64) - self.eye) @ self.axes[2]

    def scale(self, points: ArrayLike) -> Array:
        """Pixels per metre across the picture, (...), at world points [m], (..., 3)."""
        return self.focal_length / np.maximum(self.depth(points), 1e-3)

    def enlarged(self, factor: float) -> Camera:
        """Camera of the same view with `factor` times as many pixels each way."""
        x, y = self.centre
        return replace(self, focal_length=factor * self.focal_length, centre=(factor * x, factor * y))


def framing(points: ArrayLike, azimuth: float, frame: tuple[float, float, float, float]) -> Camera:
    """Nearest camera that has all points inside a frame of its picture.

    Args:
        points: points to be shown [m], (m, 3).
        azimuth: direction from the scene to the camera [rad], about z from x.
        frame: left, top, width and height of the part of the picture that is to hold them [pixels].
    """
    points = np.asarray(points, dtype=np.float64)
    left, top, width, height = frame
    cosine, sine = math.cos(azimuth), math.sin(azimuth)
    down, level = math.sin(ELEVATION), math.cos(ELEVATION)
    right = np.array([-sine, cosine, 0.0])
    into = np.array([-level * cosine, -level * sine, -down])
    axes = np.stack([right, np.cross(right, into), into])
    focal_length = width / (2.0 * math.tan(VIEW_ANGLE / 2.0))
    local = points @ axes.T
    # Along a picture axis a point must lie within +-t times its depth of the eye: two half-planes for the eye.
    eye, depth = np.zeros(3), math.inf
    for axis, size in ((0, width), (1, height)):
        t = size / (2.0 * focal_length)
        ahead, behind = (t * local[:, 2] - local[:, axis]).min(), (t * local[:, 2] + local[:, axis]).min()
        eye[axis] = (behind - ahead) / 2.0
        depth = min(depth, (ahead + behind) / (2.0 * t))
    eye[2] = depth
    centre = (left + width / 2.0, top + height / 2.0)
    return Camera(eye=eye @ axes, axes=axes, focal_length=focal_length, centre=centre)

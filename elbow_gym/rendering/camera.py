"""A pinhole camera as a pure function: world points to pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.parameters import Array

ELEVATION = math.radians(27.0)
"""How far the camera looks down."""
VIEW_ANGLE = math.radians(34.0)
"""Between the left and the right edge of the framed part of the picture."""


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Where it stands, which way it looks, and how large a picture it takes."""

    eye: Array
    """Position [m], (3,)."""
    axes: Array
    """Unit vectors of the picture's right, up and into the picture, rows of (3, 3)."""
    focal_length: float
    """Pixels per unit of tangent."""
    centre: tuple[float, float]
    """Pixel (x right, y down) that it looks straight at."""

    def project(self, points: ArrayLike) -> Array:
        """Pixels (..., 2), x right and y down from the upper left corner, of world points [m], (..., 3).

        Points behind the camera land as if they stood just before it.
        """
        seen = (np.asarray(points, dtype=np.float64) - self.eye) @ self.axes.T
        scale = self.focal_length / np.maximum(seen[..., 2], 1e-3)
        x, y = self.centre
        return np.stack([x + scale * seen[..., 0], y - scale * seen[..., 1]], axis=-1)

    def depth(self, points: ArrayLike) -> Array:
        """Distance into the picture [m], (...), of world points [m], (..., 3)."""
        return (np.asarray(points, dtype=np.float64) - self.eye) @ self.axes[2]

    def scale(self, points: ArrayLike) -> Array:
        """Pixels per metre across the picture, (...), at world points [m], (..., 3)."""
        return self.focal_length / np.maximum(self.depth(points), 1e-3)

    def enlarged(self, factor: float) -> Camera:
        """The same picture with `factor` times as many pixels each way."""
        x, y = self.centre
        return replace(self, focal_length=factor * self.focal_length, centre=(factor * x, factor * y))


def framing(points: ArrayLike, azimuth: float, frame: tuple[float, float, float, float]) -> Camera:
    """The nearest camera that sees all points inside a frame of its picture.

    Args:
        points: what has to be seen [m], (m, 3).
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
    seen = points @ axes.T
    # Along a picture axis a point must lie within +-t times its depth of the eye: two half-planes for the eye.
    eye, depth = np.zeros(3), math.inf
    for axis, size in ((0, width), (1, height)):
        t = size / (2.0 * focal_length)
        ahead, behind = (t * seen[:, 2] - seen[:, axis]).min(), (t * seen[:, 2] + seen[:, axis]).min()
        eye[axis] = (behind - ahead) / 2.0
        depth = min(depth, (ahead + behind) / (2.0 * t))
    eye[2] = depth
    centre = (left + width / 2.0, top + height / 2.0)
    return Camera(eye=eye @ axes, axes=axes, focal_length=focal_length, centre=centre)

"""Circle of an arm that was given none: the paper's, or one in the reach of the arm's last two links."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from elbow_gym.kinematics import on_table, pitches
from elbow_gym.parameters import ArmParameters, Array
from elbow_gym.task.circle import Circle

POINTS = 72
"""Number of points at which a circle is looked at."""
RADIUS = 1.0 / 6.0
"""Radius of a circle over the reach of the last two links, as the paper's arm has it [-]."""
CLEARANCE = 0.05
"""Least distance of a circle from the table, the yaw axis and the ends of the reach, over that reach [-]."""
AZIMUTH = math.pi / 4.0
"""Angle of a circle's centre about the yaw axis [rad], the paper's."""


@lru_cache(maxsize=64)
def default_circle(arm: ArmParameters, elbows: tuple[int, ...]) -> Circle:
    """The paper's circle if joints 1, n-1 and n can follow it from the start pose; else a horizontal one they can.

    The centre is the point of the vertical half plane at 45 degrees about the yaw axis whose circle is furthest from
    the table, the axis and both ends of the last two links' reach, all over that reach. Where no circle is clear of
    these, it is the paper's, in reach or not.

    Args:
        arm: the arm.
        elbows: numbers of the joints held at z = 0, which the start pose is put on.
    """
    papers = Circle()
    try:
        base, inner, outer = _last_links(arm, elbows)
    # The simulator refuses such an arm in its own words.
    except ValueError:
        return papers
    reach, hole = inner + outer, abs(inner - outer)

    def margins(circle: Circle) -> Array:
        """Distances from the far and the near end of the reach, the table and the yaw axis [m], (4,)."""
        point = circle.position(np.linspace(0.0, 2.0 * np.pi, POINTS))
        rho, z = np.hypot(point[:, 0], point[:, 1]), point[:, 2]
        distance = np.hypot(rho - base[0], z - base[1])
        return np.array([reach - distance.max(), distance.min() - hole, z.min(), rho.min()])

    if margins(papers)[:2].min() > 0.0:
        return papers
    radius = min(RADIUS * reach, (reach - hole) / 4.0)
    best, most = papers, CLEARANCE * reach
    for way in np.linspace(hole + radius, reach - radius, 13):
        for elevation in np.linspace(0.0, np.pi, 37):
            rho, z = base + way * np.array([math.cos(elevation), math.sin(elevation)])
            center = (float(rho * math.cos(AZIMUTH)), float(rho * math.sin(AZIMUTH)), float(z))
            circle = Circle(center=center, radius=float(radius))
            # A circle around the axis would have the arm whirl.
            least = float(margins(circle).min()) if rho > radius else 0.0
            if least > most:
                best, most = circle, least
    return best


def _last_links(arm: ArmParameters, elbows: Sequence[int]) -> tuple[Array, float, float]:
    """Distance from the yaw axis and height of joint n-1 in the start pose [m], (2,), and the last two lengths [m]."""
    length = arm.of_links("length")
    phi = pitches(on_table(arm, arm.nominal_pose, elbows))[:-2]
    base = np.array([length[:-2] @ np.sin(phi), length[:-2] @ np.cos(phi)])
    return base, float(length[-2]), float(length[-1])

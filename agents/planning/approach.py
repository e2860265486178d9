"""Motions from a state onto the target's path, as the voltages of computed torque, for plans to start from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agents.control.inverse_dynamics import InverseDynamics
from agents.planning.planner import View
from elbow_gym.kinematics import HandPlacement

Array = NDArray[np.float64]

ARRIVALS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0)
"""Times at which the motions reach the path [s]."""


def approaches(view: View, pose: Array, periods: int, period: float) -> Array:
    """Voltages of motions to the path, one for each of `ARRIVALS`, [V], (k, periods, n); none where it is out of reach.

    The idle joints keep their angles, or go to those of `pose` where the last two links would not reach the path.
    Until it arrives a motion is a polynomial of fifth degree that starts without acceleration.

    Args:
        view: state and motion equations of the arm, and its targets up to the last arrival at least.
        pose: another pose for the idle joints [rad], (n,).
        periods: number of control periods.
        period: length of a control period [s].
    """
    for idle in (view.state["q"], pose):
        try:
            path = HandPlacement(view.inverse.arm, idle).joints(view.target, view.velocity)
        except ValueError:
            # The last two links do not cover the path from this pose.
            continue
        motions = [_motion(view.state, *path, max(1, round(time / period)), period) for time in ARRIVALS]
        return np.stack([_voltages(view.inverse, *motion, period)[:periods] for motion in motions])
    return np.empty((0, periods, len(pose)))


def _motion(state: dict[str, Array], path: Array, rate: Array, arrival: int, h: float) -> tuple[Array, Array]:
    """Angles and rates at the ends of the periods, the state's own first, that join a path in the period `arrival`."""
    q, q_dot = np.concatenate([state["q"][None], path]), np.concatenate([state["q_dot"][None], rate])
    s, time = np.linspace(0.0, 1.0, arrival + 1)[:, None], arrival * h
    way, first, last = q[arrival] - q[0], time * q_dot[0], time * q_dot[arrival]
    a, b, c = (
        10.0 * way - 6.0 * first - 4.0 * last,
        8.0 * first + 7.0 * last - 15.0 * way,
        6.0 * way - 3.0 * (first + last),
    )
    q[: arrival + 1] = q[0] + s * (first + s * s * (a + s * (b + s * c)))
    q_dot[: arrival + 1] = (first + s * s * (3.0 * a + s * (4.0 * b + s * 5.0 * c))) / time
    return q, q_dot


def _voltages(inverse: InverseDynamics, q: Array, q_dot: Array, h: float) -> Array:
    """Voltages in the middle of the periods, where the motion is cubic between their ends."""
    middle = (q[1:] + q[:-1]) / 2.0 - h / 8.0 * np.diff(q_dot, axis=0)
    rate = 1.5 / h * np.diff(q, axis=0) - (q_dot[1:] + q_dot[:-1]) / 4.0
    return inverse.voltage(rate, inverse.drive(middle, rate, np.diff(q_dot, axis=0) / h).current)

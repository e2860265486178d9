"""Riccati recursion of many arms side by side, each around a motion of its own, with limited voltages."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.control.expansion import MeanPower

Array = NDArray[np.float64]

ROUNDS = 4
"""Most projected Newton steps that look for the voltages at their limits."""
SOLVED = 1e-9
"""Change of a voltage below which its limit is settled [V]."""


class Law(NamedTuple):
    """v = planned + step - gain (x - planned), for B arms and N periods."""

    steps: Array
    """Changes of the planned voltages [V], (B, N, n)."""
    gains: Array
    """Gains [V/rad, V s/rad, V/A], (B, N, n, 3n), zero for voltages that stay at their limit."""
    effort: Array
    """Second derivative of the cost in a period's voltages, all later periods at their best [1/V^2], (B, N, n, n)."""


def law(
    slopes: tuple[Array, Array],
    power: MeanPower,
    tracking: tuple[Array, Array],
    planned: tuple[Array, Array],
    limit: float,
) -> Law:
    """Voltages that minimise the cost to second order around the planned motions, as `expansion.riccati` has it.

    Args:
        slopes: slopes of x_(k+1) in x_k, (B, N, 3n, 3n), and in v_k, (B, N, 3n, n).
        power: energy's part.
        tracking: slope, (B, N, n), and curvature, (B, N, n, n), of the cost of the states 1..N in q.
        planned: states, (B, N + 1, 3n), and voltages [V], (B, N, n).
        limit: largest voltage [V].

    Raises:
        numpy.linalg.LinAlgError: an expanded cost has no minimum.
    """
    A, B = slopes
    (slope, curvature), (states, voltage) = tracking, planned
    arms, periods, size, n = B.shape
    steps, gains = np.zeros((arms, periods, n)), np.zeros((arms, periods, n, size))
    linear, value = np.zeros((arms, size, 1)), np.zeros((arms, size, size))
    efforts, crosses = power.curvatures(A, B)
    pulls, drifts = power.slopes(A, B, voltage, np.diff(states, axis=1))
    for k in range(periods - 1, -1, -1):
        a, b = A[:, k], B[:, k]
        value[:, :n, :n] += curvature[:, k]
        linear[:, :n, 0] += slope[:, k]
        ahead, turned = np.swapaxes(b, -1, -2) @ value, np.swapaxes(a, -1, -2)
        efforts[:, k] += ahead @ b
        effort, cross = efforts[:, k], crosses[:, k] + ahead @ a
        pull = pulls[:, k, :, None] + np.swapaxes(b, -1, -2) @ linear
        room = -limit - voltage[:, k, :, None], limit - voltage[:, k, :, None]
        step, gain = _bounded(effort, pull, cross, *room)
        back = np.swapaxes(gain, -1, -2)
        linear = (
            drifts[:, k, :, None] + turned @ linear - back @ (effort @ step + pull) + np.swapaxes(cross, -1, -2) @ step
        )
        mixed = np.swapaxes(cross, -1, -2) @ gain
        value = turned @ value @ a + back @ effort @ gain - mixed - np.swapaxes(mixed, -1, -2)
        value = (value + np.swapaxes(value, -1, -2)) / 2.0
        steps[:, k], gains[:, k] = step[..., 0], gain
    return Law(steps, gains, efforts)


def _bounded(effort: Array, pull: Array, cross: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """The steps u of least pull u + u effort u / 2 in low <= u <= high, and the gains of what is not held at a bound.

    All of B arms: effort (B, n, n), pull, low, high and u (B, n, 1), cross and gains (B, n, 3n).
    """
    np.linalg.cholesky(effort)
    both = np.linalg.solve(effort, np.concatenate([pull, cross], axis=-1))
    step, gain = -both[..., :1], both[..., 1:]
    if ((low <= step) & (step <= high)).all():
        return step, gain
    step = np.clip(step, low, high)
    free, among, settled = np.ones_like(step, dtype=bool), effort, False
    for _ in range(ROUNDS):
        uphill = pull + effort @ step
        free = ~(((step <= low + SOLVED) & (uphill > 0.0)) | ((step >= high - SOLVED) & (uphill < 0.0)))
        # What is held becomes an equation of its own, so that all arms have the same size.
        among = np.where(free & np.swapaxes(free, -1, -2), effort, 0.0) + ~free * np.eye(free.shape[1])
        found = np.clip(step - np.linalg.solve(among, free * uphill), low, high)
        settled = np.abs(found - step).max() < SOLVED
        step = found
        if settled:
            break
    return step, np.linalg.solve(among, free * cross)

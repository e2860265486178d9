"""Solution of the program by IPOPT, at one smoothing of the tracking error after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.control.trajectory import Trajectory
from agents.planning.collocation import Multipliers, Transcription

Array = NDArray[np.float64]

SMOOTHINGS = (0.01, 0.003, 0.001)
"""Lengths over which the tracking error is smoothed, one after the other [m].

A third at a time: from 30 to 3 mm at once takes a hundred iterations instead of ten.
"""
ITERATIONS = 150
"""Most iterations at one smoothing."""
# A point where nothing moves any more is as good as a KKT point to eight digits: the cost is flat in the posture.
ACCEPTABLE = {
    "acceptable_tol": 1e-2,
    "acceptable_dual_inf_tol": 1e-2,
    "acceptable_constr_viol_tol": 1e-5,
    "acceptable_obj_change_tol": 1e-4,
    "acceptable_iter": 5,
}
LOOSE, TIGHT = 1e-2, 1e-5
"""Tolerances of a solution that is but the next one's guess, and of the last one."""
LEAST_BARRIER = 1e-6
"""Weight of the barrier that a solve starts from at least and ends with [cost]."""
# As IPOPT's own plan ends, the barrier falls faster than far solutions follow: their steps become tiny.
BARRIER = {"mu_linear_decrease_factor": 0.3, "mu_superlinear_decrease_power": 1.2}
SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")

Progress = Callable[[str], None]


class SolveError(ArithmeticError):
    """No solution was found, or it did not survive its checks."""


@dataclass(frozen=True)
class Point:
    """Variables and multipliers of a program, where a solve starts or has ended."""

    x: Array
    """Variables, (size,)."""
    multipliers: Multipliers | None = None
    """Multipliers of bounds and conditions; None where there are none yet."""


@dataclass(frozen=True)
class Solution:
    """A local minimum of the program, at the smallest smoothing that converged."""

    trajectory: Trajectory
    cost: float
    """Negative return without smoothing."""
    point: Point
    smoothing: float
    """Smoothing that it is the solution at [m]."""


def variables(program: Transcription, trajectory: Trajectory) -> Array:
    """Variables of a program on a trajectory: cubic between its states, currents by inverse dynamics."""
    h, s = program.period, program.fractions[None, :, None]
    q0, q1 = trajectory.q[:-1, None], trajectory.q[1:, None]
    w0, w1 = trajectory.q_dot[:-1, None] * h, trajectory.q_dot[1:, None] * h
    a, b = 3.0 * (q1 - q0) - 2.0 * w0 - w1, 2.0 * (q0 - q1) + w0 + w1
    q = q0 + s * (w0 + s * (a + s * b))
    q_dot = (w0 + s * (2.0 * a + 3.0 * s * b)) / h
    q_ddot = (2.0 * a + 6.0 * s * b) / h**2
    voltage = trajectory.voltage
    if not voltage.any():
        wanted = program.inverse.voltage(q_dot, program.inverse.drive(q, q_dot, q_ddot).current).mean(axis=1)
        limit = 0.95 * program.problem.settings.voltage_limit
        voltage = np.clip(wanted, -limit, limit)
    return program.join(q, q_dot, q_ddot, voltage)


def solve(
    program: Transcription,
    guess: Trajectory | Point,
    smoothings: Sequence[float] = SMOOTHINGS,
    progress: Progress = lambda _: None,
    max_iter: int = ITERATIONS,
    barrier: float | None = None,
    tolerance: float = TIGHT,
) -> Solution:
    """IPOPT at one smoothing after the other; a smaller one that fails leaves the solution of the one before.

    The barrier falls with the smoothing: between them a solution is but the next one's guess. The least one that is
    left at the last smoothing makes the cost some millionths larger than none would.

    Args:
        program: program to solve.
        guess: a motion, or a point of the program.
        smoothings: lengths over which the tracking error is smoothed [m], one after the other.
        progress: called with a line on every smoothing.
        max_iter: most iterations at one smoothing.
        barrier: weight of the barrier at the first smoothing [cost]; one that fits the guess when None.
        tolerance: largest residual of the first-order conditions at the last smoothing.

    Raises:
        SolveError: the first smoothing did not converge.
    """
    if not smoothings:
        raise ValueError("smoothings must have at least one length, got none")
    point = guess if isinstance(guess, Point) else Point(variables(program, guess))
    feasible = isinstance(guess, Trajectory) and bool(guess.voltage.any())
    if barrier is None:
        barrier = 1e-6 if point.multipliers is not None else 1e-3 if feasible else 0.1
    # What the simulator made is nearly feasible: the barrier need not push it away from its bounds first.
    options = {"bound_push": 1e-4, "bound_frac": 1e-4} if feasible else {}

    def step(smoothing: float, start: float, end: float, tolerance: float, **more: float) -> str:
        nonlocal point, barrier
        goal = {"mu_target": end, "tol": tolerance}
        x, multipliers, stats = program.solve(
            point.x,
            smoothing,
            point.multipliers,
            **{**ACCEPTABLE, **BARRIER, "mu_init": start, "max_iter": max_iter, **goal, **more},
        )
        status = str(stats["return_status"])
        progress(f"smoothing {smoothing * 1e3:g} mm, {stats['iter_count']} iterations: {status}")
        if status in SOLVED:
            point, barrier = Point(x, multipliers), end
        return status

    reached = None
    for smoothing in smoothings:
        end = LEAST_BARRIER if smoothing == smoothings[-1] else max(barrier / 10.0, LEAST_BARRIER)
        status = step(smoothing, barrier, end, tolerance if smoothing == smoothings[-1] else LOOSE, **options)
        options = {}
        if status not in SOLVED:
            if reached is not None:
                status = step(reached, barrier, LEAST_BARRIER, tolerance)
            if status not in SOLVED:
                raise SolveError(f"IPOPT must converge at a smoothing of {reached or smoothing} m, got {status}")
            break
        reached = smoothing
    return Solution(trajectory_of(program, point.x), program.cost(point.x), point, reached or smoothings[0])


def trajectory_of(program: Transcription, x: Array) -> Trajectory:
    """States at the ends of the control periods and voltages of a program's variables."""
    parts, voltage = program.split(x)
    start = {"q": program.problem.start, "q_dot": np.zeros(program.n), "current": np.zeros(program.n)}
    states = {name: np.concatenate([first[None], parts[name][:, -1]]) for name, first in start.items()}
    return Trajectory(**states, voltage=voltage)

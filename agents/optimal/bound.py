"""Bound on the return: the best one that direct transcription finds for an environment, played in the simulator.

Each of several postures gives a solution with two Radau points a period; the best is solved again with three. The cost
that counts is the simulator's: of the planned voltages open loop, and of the plan under the time-varying LQR.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.lqr import TimeVaryingLQR
from agents.control.minimum_jerk import minimum_jerk
from agents.control.posture import best_postures
from agents.control.trajectory import OpenLoop, Trajectory
from agents.evaluation.metrics import metrics
from agents.evaluation.recording import Recording, record
from agents.optimal.collocation import Problem, Transcription
from elbow_gym.kinematics import inverse_kinematics
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

Array = NDArray[np.float64]

SMOOTHINGS = (0.03, 0.003, 0.001)
"""Lengths over which the tracking error is smoothed, one after the other [m]."""
ROUGH_SMOOTHINGS = (0.3, 0.03)
ROUGH_ITERATIONS = 60
"""Most iterations with one point in a period, whose smoothings are ROUGH_SMOOTHINGS [m]."""
ITERATIONS = 250
"""Most iterations at one smoothing."""
REACH_TIME = 1.0
"""Time of a guess from the start to its posture [s]."""
COARSE, FINE = 2, 3
"""Numbers of Radau points in a control period, in the search and in the refinement."""
REFINEMENT = 0.005
"""Largest change of the cost from COARSE to FINE, as a share of it [-]."""
REPLAY = 0.02
"""Largest difference of the simulator's cost under the LQR from the predicted one, as a share of it [-]."""
# A point where nothing moves any more is as good as a KKT point to eight digits: the cost is flat in the posture.
ACCEPTABLE = {
    "acceptable_tol": 1e-2,
    "acceptable_dual_inf_tol": 1e-2,
    "acceptable_constr_viol_tol": 1e-5,
    "acceptable_obj_change_tol": 1e-4,
    "acceptable_iter": 5,
}
SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")

Progress = Callable[[str], None]


class SolveError(ArithmeticError):
    """No solution was found, or it did not survive its checks."""


@dataclass(frozen=True)
class Solution:
    """A local minimum of the program, at the smallest smoothing that converged."""

    trajectory: Trajectory
    cost: float
    """Negative return without smoothing."""


@dataclass(frozen=True)
class Optimum:
    """Best solution, and its costs in the simulator without noise."""

    trajectory: Trajectory
    """States of the simulator under the LQR, and the voltages of the LQR, which repeat them open loop."""
    predicted_cost: float
    """Negative return of the solution on the fine mesh."""
    coarse_cost: float
    """Negative return of the solution with `COARSE` points in a period."""
    planned_open_loop: float
    """Negative return of the planned voltages, open loop."""
    closed_loop: float
    """Negative return of the plan under the LQR."""
    open_loop: float
    """Negative return of `trajectory`'s voltages, open loop."""
    energy: float
    """Electrical energy of `trajectory` [J]."""
    energy_tracking: float
    """Electrical energy of `trajectory` from 2 s on [J]."""
    error_rms: float
    """Root mean square of the tracking error from 2 s on [mm]."""
    error_mean: float
    """Mean tracking error at the ends of the control periods [m]."""
    guess: str
    """Name of the guess that led to the solution."""
    seconds: float
    """Duration of the solve [s]."""

    @property
    def figures(self) -> dict[str, Any]:
        """All fields but the trajectory, JSON types only."""
        return {name: value for name, value in asdict(self).items() if name != "trajectory"}


def posture_guesses(problem: Problem) -> dict[str, Trajectory]:
    """Smooth motions from the start to the paper's posture and to the best posture at rest, by name."""
    settings = problem.settings
    arm, circle, elbows = settings.parsed_arm, settings.parsed_circle, settings.elbow_joints
    best = best_postures(arm, elbows, circle, problem.above_table)[0]
    poses = {"paper posture": np.array(arm.nominal_pose), f"posture of {best.copper_loss:.1f} W": best.pose}
    instants = settings.control_period * np.arange(settings.horizon + 1)
    angle = circle.angle(instants, float(circle.phase))
    grown, rate, _ = minimum_jerk(instants / REACH_TIME)
    guesses = {}
    for name, pose in poses.items():
        q_d, q_d_dot = inverse_kinematics(arm, pose, circle.position(angle), circle.velocity(angle))
        q = problem.start + grown[:, None] * (q_d - problem.start)
        q_dot = rate[:, None] / REACH_TIME * (q_d - problem.start) + grown[:, None] * q_d_dot
        guesses[name] = Trajectory(q, q_dot, np.zeros_like(q), np.zeros_like(q[1:]))
    return guesses


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
    guess: Trajectory,
    smoothings: Sequence[float] = SMOOTHINGS,
    progress: Progress = lambda _: None,
    max_iter: int = ITERATIONS,
) -> Solution:
    """IPOPT at one smoothing after the other; a smaller one that fails leaves the solution of the one before.

    Raises:
        SolveError: the first smoothing did not converge.
    """
    x, multipliers = variables(program, guess), None
    # A guess that the simulator made is nearly feasible: the barrier need not push it away from its bounds first.
    near = {"mu_init": 1e-3, "bound_push": 1e-4, "bound_frac": 1e-4} if guess.voltage.any() else {}
    for smoothing in smoothings:
        found, after, stats = program.solve(x, smoothing, multipliers, max_iter=max_iter, **ACCEPTABLE, **near)
        near = {}
        status = str(stats["return_status"])
        progress(f"smoothing {smoothing * 1e3:g} mm, {stats['iter_count']} iterations: {status}")
        if status not in SOLVED:
            if multipliers is None:
                raise SolveError(f"IPOPT must converge at a smoothing of {smoothing} m, got {status}")
            break
        x, multipliers = found, after
    parts, voltage = program.split(x)
    states = {name: parts[name][:, -1] for name in ("q", "q_dot", "current")}
    start = {"q": program.problem.start, "q_dot": np.zeros(program.n), "current": np.zeros(program.n)}
    whole = {name: np.concatenate([start[name][None], value]) for name, value in states.items()}
    return Solution(Trajectory(**whole, voltage=voltage), program.cost(x))


def simulated(problem: Problem, trajectory: Trajectory) -> tuple[Trajectory, Recording]:
    """States and voltages of the simulator under the LQR around a trajectory, without noise, and the recording."""
    _, recording = rollout(problem.settings, lambda env: TimeVaryingLQR(env, trajectory))
    states = (recording.q[:, 0], recording.q_dot[:, 0], recording.current[:, 0])
    return Trajectory(*states, recording.voltage[1:, 0]), recording


def approach(rough: Transcription, guess: Trajectory, progress: Progress) -> Trajectory:
    """A better guess, where there is one: solved with one point a period, then played in the simulator.

    One point damps what is fast, so that a far guess converges too, but its cost is some percent off and its states are
    not the arm's.
    """
    if guess.voltage.any():
        return guess
    try:
        return simulated(rough.problem, solve(rough, guess, ROUGH_SMOOTHINGS, progress, ROUGH_ITERATIONS).trajectory)[0]
    except ArithmeticError as error:
        progress(str(error))
        return guess


def best_solution(problem: Problem, guesses: dict[str, Trajectory], progress: Progress) -> tuple[str, Solution]:
    """The cheapest of the solutions from all guesses, with `COARSE` points, and its guess's name.

    Raises:
        SolveError: no guess led to a solution.
    """
    rough, program = Transcription(problem, 1), Transcription(problem, COARSE)
    found: dict[str, Solution] = {}
    for k, (name, guess) in enumerate(guesses.items(), start=1):

        def say(line: str, place: str = f"{name} ({k}/{len(guesses)})") -> None:
            progress(f"{place}: {line}")

        try:
            found[name] = solve(program, approach(rough, guess, say), progress=say)
        except SolveError as error:
            progress(f"{name}: {error}")
    if not found:
        raise SolveError(f"a guess must lead to a solution, got none from {sorted(guesses)}")
    best = min(found, key=lambda name: found[name].cost)
    return best, found[best]


def refined(problem: Problem, guess: Trajectory, progress: Progress) -> Solution:
    """The solution on the fine mesh, from the coarse one as the simulator plays it.

    Mostly its last smoothings are enough; where the first of them does not converge, all are taken.

    Raises:
        SolveError: neither way converged.
    """
    program = Transcription(problem, FINE)
    try:
        return solve(program, guess, SMOOTHINGS[1:], progress)
    except SolveError as error:
        progress(str(error))
        return solve(program, guess, SMOOTHINGS, progress)


def optimum(
    problem: Problem, guesses: dict[str, Trajectory], progress: Progress = lambda _: None, refine: bool = True
) -> Optimum:
    """Solves a problem from several guesses, refines the best and plays it in the simulator.

    Args:
        problem: problem to solve.
        guesses: motions to start from, by name.
        progress: called with a line on every solve.
        refine: whether the mesh is refined; if not, the simulator's verdict alone is the check.

    Raises:
        SolveError: no guess converged, refining changed the cost by more than `REFINEMENT`, or the simulator's cost
            under the LQR is not within `REPLAY` of the predicted one.
    """
    started = time.monotonic()
    name, coarse = best_solution(problem, guesses, progress)
    fine = coarse
    if refine:
        fine = refined(problem, simulated(problem, coarse.trajectory)[0], progress)
    if abs(fine.cost - coarse.cost) > REFINEMENT * abs(fine.cost):
        raise SolveError(
            f"refining must change the cost by at most {REFINEMENT:.1%}, got {coarse.cost:.5g} -> {fine.cost:.5g}"
        )
    settings = problem.settings
    planned, _ = rollout(settings, lambda env: OpenLoop(env, fine.trajectory))
    played, recording = simulated(problem, fine.trajectory)
    repeated, _ = rollout(settings, lambda env: OpenLoop(env, played))
    whole, later = metrics(recording), metrics(recording, 2.0)
    reached = -float(whole["return"][0])
    if abs(reached - fine.cost) > REPLAY * abs(fine.cost):
        raise SolveError(f"the simulator must reach the cost {fine.cost:.5g} to {REPLAY:.0%}, got {reached:.5g}")
    error = np.linalg.norm(recording.hand - recording.target, axis=-1)[1:]
    return Optimum(
        played,
        fine.cost,
        coarse.cost,
        -planned,
        reached,
        -repeated,
        float(whole["electrical_energy"][0]),
        float(later["electrical_energy"][0]),
        float(later["error_rms"][0]),
        float(error.mean()),
        name,
        round(time.monotonic() - started, 1),
    )


def rollout(settings: Settings, make_controller: Callable[[ElbowArmVectorEnv], Any]) -> tuple[float, Recording]:
    """Return and recording of one episode from the start without noise."""
    arguments = {**settings.arguments, "start_noise": 0.0}
    recording = record(Settings(**arguments), make_controller, [0])
    return float(metrics(recording)["return"][0]), recording

"""Checks of a solution: first-order conditions, mesh, and the cost that the simulator makes of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from agents.control.trajectory import OpenLoop, Trajectory
from agents.evaluation.metrics import metrics
from agents.optimal.guesses import cost_of, rollout, simulated
from agents.optimal.solution import Solution, SolveError
from agents.planning.collocation import Transcription

REFINEMENT = 0.005
"""Largest change of the cost from COARSE to FINE, as a share of it [-]."""
REPLAY = 0.02
"""Largest difference of the simulator's cost under the LQR from the predicted one, as a share of it [-]."""
LATER = 2.0
"""Time from which the hand is taken to be on its path [s]."""
STATIONARITY = 0.01
"""Largest entry of the Lagrangian's gradient at the solution."""
COMPLEMENTARITY = 1e-4
"""Largest product of a bound's multiplier and the distance from it, as a share of the cost [-]."""


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


@dataclass(frozen=True)
class Certificate:
    """Evidence that a solution is a local optimum of the episode."""

    stationarity: float
    """Largest entry of the Lagrangian's gradient at the solution on the finest mesh [cost per unit of a variable]."""
    violation: float
    """Largest violation of the program's conditions (N m, m/s, rad, rad/s, V)."""
    complementarity: float
    """Largest product of a bound's multiplier and the distance from it [cost]."""
    smoothing: float
    """Smoothing of the tracking error that the solution was found with [m]."""
    mesh_change: float
    """Change of the cost from `COARSE` to `FINE` points, as a share of it [-]; zero where the mesh was not refined."""
    replay_error: float
    """Difference of the simulator's cost under the LQR from the predicted one, as a share of it [-]."""


@dataclass(frozen=True)
class Bound:
    """The best known solution of a task, and its certificate."""

    optimum: Optimum
    certificate: Certificate
    cpu_seconds: float
    """CPU time of the solve, all processes together [s]."""

    @property
    def cost(self) -> float:
        """Negative return of the plan under the LQR in the simulator without noise."""
        return self.optimum.closed_loop

    @property
    def figures(self) -> dict[str, Any]:
        """All but the trajectory, JSON types only."""
        return {**self.optimum.figures, **asdict(self.certificate), "cpu_seconds": self.cpu_seconds}

    @classmethod
    def from_figures(cls, figures: Mapping[str, Any], trajectory: Trajectory) -> Bound:
        """The inverse of `figures`."""
        parts = [
            {field.name: figures[field.name] for field in fields(part) if field.name != "trajectory"}
            for part in (Optimum, Certificate)
        ]
        return cls(Optimum(trajectory, **parts[0]), Certificate(**parts[1]), figures["cpu_seconds"])


def checked(
    program: Transcription, solution: Solution, coarse_cost: float, guess: str, took: Callable[[], tuple[float, float]]
) -> Bound:
    """Plays a solution in the simulator and checks it.

    Args:
        program: program of the solution.
        solution: solution with multipliers.
        coarse_cost: negative return on the coarser mesh, the solution's own where there is none.
        guess: name of the guess that led to it.
        took: gives the time and the CPU time of the solve so far [s].

    Raises:
        SolveError: a check failed, which is named.
    """
    if solution.point.multipliers is None:
        raise ValueError("solution must have multipliers, got None")
    stationarity, violation, complementarity = program.residuals(
        solution.point.x, solution.smoothing, solution.point.multipliers
    )
    if stationarity > STATIONARITY:
        raise SolveError(f"the Lagrangian's gradient must be at most {STATIONARITY}, got {stationarity:.3g}")
    if complementarity > COMPLEMENTARITY * abs(solution.cost):
        raise SolveError(
            f"a bound's multiplier times the distance from it must be at most {COMPLEMENTARITY:g} of the cost "
            f"{solution.cost:.5g}, got {complementarity:.3g}"
        )
    if abs(solution.cost - coarse_cost) > REFINEMENT * abs(solution.cost):
        raise SolveError(
            f"refining must change the cost by at most {REFINEMENT:.1%}, got {coarse_cost:.5g} -> {solution.cost:.5g}"
        )
    problem, settings = program.problem, program.problem.settings
    planned, _ = rollout(settings, lambda env: OpenLoop(env, solution.trajectory))
    played, recording = simulated(problem, solution.trajectory)
    repeated, _ = rollout(settings, lambda env: OpenLoop(env, played))
    whole = metrics(recording)
    later = metrics(recording, LATER) if recording.time[-1] > LATER else whole
    reached = cost_of(recording)
    if abs(reached - solution.cost) > REPLAY * abs(solution.cost):
        raise SolveError(f"the simulator must reach the cost {solution.cost:.5g} to {REPLAY:.0%}, got {reached:.5g}")
    error = np.linalg.norm(recording.hand - recording.target, axis=-1)[1:]
    seconds, cpu_seconds = took()
    optimum = Optimum(
        played,
        solution.cost,
        coarse_cost,
        planned,
        reached,
        repeated,
        float(whole["electrical_energy"][0]),
        float(later["electrical_energy"][0]),
        float(later["error_rms"][0]),
        float(error.mean()),
        guess,
        round(seconds, 1),
    )
    certificate = Certificate(
        stationarity,
        violation,
        complementarity,
        solution.smoothing,
        abs(solution.cost - coarse_cost) / abs(solution.cost),
        abs(reached - solution.cost) / abs(solution.cost),
    )
    return Bound(optimum, certificate, round(cpu_seconds, 1))

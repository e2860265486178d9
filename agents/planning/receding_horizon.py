"""Receding-horizon control: the collocation program of the next control periods, solved anew in every one."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from agents.planning.collocation import Multipliers, Transcription
from agents.planning.planner import Planner, View
from agents.planning.task import check_modelled
from elbow_gym.interface import Environment
from elbow_gym.kinematics import hand_position
from elbow_gym.task.settings import Settings

Array = NDArray[np.float64]

HORIZON = 0.3
"""Time that a plan looks ahead [s]."""
RESTING, BRAKING = 1.0, 0.05
"""Times of the tail [s]."""
DEGREE = 2
"""Radau points in a control period."""
SMOOTHING, FAR_SMOOTHING, SHARE = 0.01, 0.05, 0.05
"""Least and largest length that smooths the tracking error e to sqrt(e^2 + length^2) [m], and its share of the hand's
distance from the target in between [-]. What is far off needs no sharper one, and the solver then fails less."""
FIRST_SMOOTHING = 0.1
"""Length with which a first solve from an arm at rest starts [m]."""
FIRST_ITERATIONS, ITERATIONS = 60, 20
"""Most iterations from rest and from the last plan."""
# The next control period corrects what is left, and a tighter solve wanders in the flat valley of the postures.
TOLERANCES = {
    "tol": 1e-3,
    "dual_inf_tol": 1e-2,
    "constr_viol_tol": 1e-5,
    "acceptable_tol": 1e-2,
    "acceptable_dual_inf_tol": 1e-1,
    "acceptable_constr_viol_tol": 1e-4,
    "acceptable_obj_change_tol": 1e-3,
    "acceptable_iter": 2,
}
WARM_BARRIER = 1e-3
"""Barrier that a solve from the last plan starts with."""
SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")


@dataclass(frozen=True)
class Window:
    """Control periods ahead, as `Transcription` takes them."""

    settings: Settings
    start: Array
    target: Array
    above_table: bool = False


@dataclass(frozen=True)
class Plan:
    """Solution of a program."""

    x: Array
    """Variables, (size,)."""
    multipliers: Multipliers | None = None
    """Multipliers of bounds and conditions; None where it is no solution."""


class RecedingHorizon(Planner):
    """Model-predictive control by the transcription of the bound, from the last solution, shifted.

    Where IPOPT does not converge, the shifted plan is carried out as it is, and `failures` counts. Joints may go below
    the table, as a policy's may. Needs CasADi.

    Args:
        env: the environment that it will act in.
        horizon: time that plans look ahead [s].
        estimate_payload: whether the payload is estimated from the motion; otherwise there is taken to be none.

    Raises:
        ValueError: the environment has what the program does not know, which is named, or CasADi is missing.
    """

    def __init__(self, env: Environment, *, horizon: float = HORIZON, estimate_payload: bool = False) -> None:
        super().__init__(env, horizon, RESTING, BRAKING, estimate_payload=estimate_payload)
        check_modelled(self.settings)
        if find_spec("casadi") is None:
            raise ValueError('casadi must be installed for receding-horizon control: pip install "elbow-gym[optimal]"')
        window = Window(self.settings, self.interface.pose, np.zeros((self.periods, 3)))
        self._program = Transcription(window, DEGREE, self.tail)
        self._plans: dict[int, Plan] = {}
        self.failures = 0
        """Number of control periods in which the solver did not converge."""

    def _decide(self, arm: int, view: View) -> Array:
        program = self._program
        program.begin(view.state, view.target, view.velocity[-1], view.inverse)
        before = self._plans.get(arm)
        hand = hand_position(self.interface.arm, view.state["q"])
        near = float(np.clip(SHARE * np.linalg.norm(hand - view.target[0]), SMOOTHING, FAR_SMOOTHING))
        plan = self._resting(view) if before is None else Plan(*program.later(before.x, before.multipliers))
        if plan.multipliers is None:
            # The first solve, or one behind a failure: from rest, since a failed plan leads nowhere.
            found = self._solved(self._resting(view), FIRST_SMOOTHING, max_iter=FIRST_ITERATIONS)
            found = found and self._solved(found, near, max_iter=FIRST_ITERATIONS, mu_init=WARM_BARRIER)
        else:
            found = self._solved(plan, near, max_iter=ITERATIONS, mu_init=WARM_BARRIER)
        if found is None:
            # Multipliers of what is no solution would lead the next solve astray, too.
            found = Plan(plan.x)
            self.failures += 1
        self._plans[arm] = found
        return program.split(found.x)[1][0]

    def _solved(self, plan: Plan, smoothing: float, **options: float) -> Plan | None:
        """Solution from a plan; None where the solver does not converge."""
        x, multipliers, stats = self._program.solve(plan.x, smoothing, plan.multipliers, **TOLERANCES, **options)
        return Plan(x, multipliers) if stats["return_status"] in SOLVED else None

    def _resting(self, view: View) -> Plan:
        """The arm held in its pose with least copper loss."""
        program, pose = self._program, view.state["q"]
        q = np.broadcast_to(pose, (program.periods, program.degree, program.n))
        still = np.zeros_like(q)
        hold = view.inverse.resistance * view.inverse.hold(pose).current
        return Plan(program.join(q, still, still, np.tile(hold, (program.periods, 1))))

"""Sampling control: the best of many random changes of a plan, played on the batch kernel."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.control.posture import slopes
from agents.planning.approach import ARRIVALS, approaches
from agents.planning.branches import Branches
from agents.planning.planner import Planner, View, shifted
from elbow_gym.checks import positive_integer
from elbow_gym.interface import Environment
from elbow_gym.kinematics import hand_position

Array = NDArray[np.float64]

HORIZON = 0.24
"""Time that a plan looks ahead [s]."""
RESTING, BRAKING = 1.0, 0.05
"""Times of the tail [s]."""
KNOTS = 3
"""Instants whose voltages are drawn; between them they are interpolated."""
SAMPLES, ROUNDS = 128, 3
"""Plans played side by side, and how often in a control period."""
BEST = 16
"""Number of plans whose weighted mean gives the direction of the next step."""
STRIDES = (0.0, 0.2, 0.4, 0.7, 1.0, 1.5, 2.2)
"""Lengths of the steps that are tried along it, as multiples."""
SPREAD = 3.0
"""Standard deviation of the drawn voltages at the start [V]."""
SMALLEST, LARGEST = 0.3, 5.0
"""Bounds of a standard deviation [V]."""
VARIETY = 0.5
"""Standard deviation of its logarithm between samples, from which the next one is learned."""
GROWTH = 1.1
"""Factor of the standard deviations from one control period to the next."""
RESTART = 1.0
"""Least standard deviation where an approach takes the plan's place [V]."""


class Plan(NamedTuple):
    """Voltages ahead, and how widely others are drawn around them."""

    voltage: Array
    """Voltages of the control periods [V], (N, n)."""
    spread: Array
    """Standard deviations at the knots [V]: of voltages that move the hand, and of those that only change the
    posture."""


class Sampling(Planner):
    """Model-predictive control by sampling, after MPPI and evolution strategies.

    The plan of the period before, shifted, is changed by smooth random voltages. The best samples count with weights
    that fall with the rank; a step along their mean is taken as far as it pays. Voltages that move the hand and those
    that only change the posture have spreads of their own, which adapt themselves. In the first round, computed
    torque's approaches to the path compete.

    Args:
        env: the environment that it will act in.
        seed: seed of the samples; every arm of a batch draws the same ones.
        horizon: time that plans look ahead [s].
        samples: plans played side by side, more than `ARRIVALS` has.
        rounds: how often in a control period.
        estimate_payload: whether the payload is estimated from the motion; otherwise there is taken to be none.
    """

    def __init__(
        self,
        env: Environment,
        seed: int = 0,
        *,
        horizon: float = HORIZON,
        samples: int = SAMPLES,
        rounds: int = ROUNDS,
        estimate_payload: bool = False,
    ) -> None:
        super().__init__(env, horizon, RESTING, BRAKING, ARRIVALS[-1], estimate_payload)
        self._seed, self._rounds = seed, positive_integer("rounds", rounds)
        self._samples = positive_integer("samples", samples)
        if samples < len(ARRIVALS) + 2:
            raise ValueError(f"samples must be at least {len(ARRIVALS) + 2}, got {samples}")
        self._branches = Branches(self.settings, self.tail, self.interface.action, (samples, len(STRIDES) + 1))
        at = np.linspace(0.0, KNOTS - 1.0, self.periods)
        self._smooth = np.stack([np.interp(at, np.arange(KNOTS), row) for row in np.eye(KNOTS)], axis=1)
        best = min(BEST, samples // 2)
        weights = np.log(best + 0.5) - np.log(np.arange(1, best + 1))
        self._weights = weights / weights.sum()
        self._plans: dict[int, Plan] = {}
        self._decisions: dict[int, int] = {}

    def _decide(self, arm: int, view: View) -> Array:
        # Neither other arms nor the order in which they are asked change an arm's samples.
        number = self._decisions.get(arm, 0)
        self._decisions[arm] = number + 1
        rng = np.random.default_rng([self._seed, number])
        n = self.interface.arm.n_joints
        before = self._plans.get(arm)
        if before is None:
            plan = Plan(np.zeros((self.periods, n)), np.full(2, SPREAD))
        else:
            plan = Plan(shifted(before.voltage), np.minimum(GROWTH * before.spread, LARGEST))
        guesses, sides = self._guesses(view), self._sides(view)
        for _ in range(self._rounds):
            plan = self._improved(plan, view, guesses, sides, rng)
            guesses = guesses[:0]
        self._plans[arm] = plan
        return plan.voltage[0]

    def _guesses(self, view: View) -> Array:
        """Plans that compete with the samples [V], (k, N, n): standing still, and approaches."""
        interface = self.interface
        still = view.inverse.resistance * view.inverse.hold(view.state["q"]).current
        found = approaches(view, interface.pose, self.periods, interface.control_period)
        return np.concatenate([np.tile(still, (1, self.periods, 1)), found])

    def _sides(self, view: View) -> Array:
        """Projections of voltages, (2, n, n), onto those that move the hand, and onto the others.

        Against the back-EMF a voltage is nearly a rate.
        """
        jacobian = slopes(partial(hand_position, self.interface.arm), view.state["q"])
        moving = np.linalg.pinv(jacobian) @ jacobian
        return np.stack([moving, np.eye(len(moving)) - moving])

    def _improved(self, plan: Plan, view: View, guesses: Array, sides: Array, rng: np.random.Generator) -> Plan:
        """A plan that costs no more, after one round of samples."""
        free, limit = self._samples - len(guesses), self.interface.voltage_limit
        half = (free + 1) // 2
        # In opposite pairs, whose mean is the plan.
        noise = rng.normal(size=(half, KNOTS, plan.voltage.shape[1]))
        variety = np.concatenate([rng.normal(size=(half, 2))] * 2)[:free]
        scale = plan.spread * np.exp(VARIETY * variety)
        changes = np.einsum("skn,sg,gnm->skm", np.concatenate([noise, -noise])[:free], scale, sides)
        drawn = plan.voltage + np.einsum("hk,skn->shn", self._smooth, changes)
        plans = np.clip(np.concatenate([guesses, drawn]), -limit, limit)
        order = np.argsort(self._branches.costs(view, plans), kind="stable")[: len(self._weights)]
        mean = np.einsum("s,shn->hn", self._weights, plans[order])
        steps = plan.voltage + np.multiply.outer(STRIDES, mean - plan.voltage)
        tried = np.clip(np.concatenate([steps, plans[order[:1]]]), -limit, limit)
        chosen = int(np.argmin(self._branches.costs(view, tried)))
        own = order >= len(guesses)
        # The best samples tell by their own spreads which one the next samples should have.
        share = self._weights[own].sum()
        lesson = self._weights[own] @ variety[order[own] - len(guesses)] / share if share > 0.2 else 0.0
        spread = np.clip(plan.spread * np.exp(VARIETY * lesson), SMALLEST, LARGEST)
        if chosen == len(STRIDES) and order[0] < len(guesses):
            spread = np.maximum(spread, RESTART)
        return Plan(tried[chosen], spread)

"""Descent to a local optimum in the simulator itself: iterative LQR with limited voltages.

Every iterate is a motion that the arm makes, so that it cannot fail to converge as a program can, and an iteration
takes a third of one of the program's. What it leaves out, the curvature of the arm's motion, makes its end slow: it
comes within some percent, from where the program has a short way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.control.expansion import MeanPower, riccati, tracking
from agents.control.inverse_dynamics import InverseDynamics
from agents.control.lqr import Linearisation
from agents.control.trajectory import Trajectory
from agents.optimal.problem import Problem
from elbow_gym.kinematics import constraint_jacobian, elbow_heights
from elbow_gym.simulator import Simulator

Array = NDArray[np.float64]

STAGES = ((0.1, 1e3), (0.03, 1e3), (0.01, 3e3))
"""Smoothings of the tracking error [m] with the prices of depth below the table [1/m^2], one after the other."""
ITERATIONS = 40
"""Most iterations at one stage."""
SETTLED = 4e-3
"""Gain of an iteration, as a share of the cost, below which two in a row end a stage, or five of dear steps [-]."""
SHARES = 0.5 ** np.arange(8)
"""Shares of a step that are tried side by side [-]."""
LEAST, MOST = 1e-7, 10.0
"""Range of the price of a step [cost/V^2]."""
CHEAP = 1e-5
"""Price of a step up to which it is nearly as long as without one [cost/V^2]."""
CLEARANCE = 0.002
"""Height above the table from which on depth is counted [m], so that what is left of it is above the table."""
REGULAR = 1e-4
"""Cost of a change of an angle at a smoothing without a limit [1/rad^2], which the hand alone would leave free."""


@dataclass(frozen=True)
class Descended:
    """End of a descent."""

    trajectory: Trajectory
    cost: float
    """Smoothed cost at the last stage, depth below the table included."""
    depth: float
    """Depth of the lowest joint below the table, if it must not be there [m]."""


class Descent:
    """Descent of one problem.

    Args:
        problem: problem to solve.
    """

    def __init__(self, problem: Problem) -> None:
        settings = problem.settings
        arm, n = settings.parsed_arm, settings.parsed_arm.n_joints
        self._problem, self._settings, self._n = problem, settings, n
        self._power, self._linearised = MeanPower(settings), Linearisation(settings, settings.horizon, central=False)
        self._inverse = InverseDynamics(arm, settings.elbow_joints, settings.payload)
        # Number n + 1 is the hand.
        self._above = [j for j in range(3, n + 2) if j not in settings.elbow_joints] if problem.above_table else []
        self._simulator = Simulator(
            arm,
            settings.elbow_joints,
            len(SHARES),
            conditions=settings.conditions,
            timestep=float(settings.substeps.min()),
            integrator=settings.integrator,
        )

    def __call__(self, guess: Trajectory, stages: Sequence[tuple[float, float]] = STAGES) -> Descended:
        """The end of the descent from a motion, from whose feedback the simulator makes the first iterate.

        Args:
            guess: motion to start from, without voltages one that the arm need not be able to make.
            stages: stages to go through.

        Raises:
            ArithmeticError: the arm leaves what can be represented on every way that is tried.
            ValueError: a pose of the motion is not near one with the elbows at z = 0.
        """
        states, voltage = guess.states, guess.voltage
        if not voltage.any():
            states, voltage = self._driven(guess)
        smoothing, depth_price = stages[0]
        _, curvature = self._expanded(states, smoothing, depth_price)
        slopes = self._linearised(states[:-1], voltage)
        gains = riccati(slopes, self._power, curvature)[1]
        states, voltage, cost = self._best(states, voltage, np.zeros_like(voltage), gains, smoothing, depth_price)
        if not np.isfinite(cost):
            raise ArithmeticError("the arm must follow a guess in the simulator, got a state beyond representation")
        for smoothing, depth_price in stages:
            states, voltage, cost = self._stage(states, voltage, smoothing, depth_price)
        heights = elbow_heights(self._settings.parsed_arm, states[:, : self._n], self._above)
        return Descended(Trajectory.from_states(states, voltage), cost, float(max(-heights.min(initial=0.0), 0.0)))

    def _driven(self, guess: Trajectory) -> tuple[Array, Array]:
        """States and voltages of a motion by inverse dynamics."""
        inverse, q, q_dot = self._inverse, guess.q, guess.q_dot
        q_ddot = inverse.held_acceleration(q, q_dot, np.gradient(q_dot, self._settings.control_period, axis=0))
        current = inverse.drive(q, q_dot, q_ddot).current
        voltage = inverse.voltage((q_dot[1:] + q_dot[:-1]) / 2.0, (current[1:] + current[:-1]) / 2.0)
        limit = self._settings.voltage_limit
        return np.concatenate([q, q_dot, current], axis=-1), np.clip(voltage, -limit, limit)

    def _stage(self, states: Array, voltage: Array, smoothing: float, depth_price: float) -> tuple[Array, Array, float]:
        cost = float(self._cost(states, voltage, smoothing, depth_price))
        price, small, slopes, expanded = LEAST, 0, None, None
        for _ in range(ITERATIONS):
            if slopes is None or expanded is None:
                slopes = self._linearised(states[:-1], voltage)
                expanded = self._expanded(states, smoothing, depth_price)
            slope, curvature = expanded
            try:
                steps, gains = riccati(
                    slopes, self._power, curvature, slope, (states, voltage), self._settings.voltage_limit, price
                )
                found = self._best(states, voltage, steps, gains, smoothing, depth_price)
            except np.linalg.LinAlgError:
                found = states, voltage, np.inf
            if found[2] >= cost:
                price *= 10.0
                if price > MOST:
                    break
                continue
            small = small + 1 if cost - found[2] < SETTLED * cost else 0
            # Steps that are short because they are dear say little about what is left to gain.
            settled = small == (2 if price <= CHEAP else 5)
            (states, voltage, cost), slopes, price = found, None, max(LEAST, 0.1 * price)
            if settled:
                break
        return states, voltage, cost

    def _best(
        self, states: Array, voltage: Array, steps: Array, gains: Array, smoothing: float, depth_price: float
    ) -> tuple[Array, Array, float]:
        """Cheapest of what the simulator makes of `SHARES` of the steps under the gains, and its cost."""
        simulator, limit = self._simulator, self._settings.voltage_limit
        simulator.reset(self._problem.start)
        now = np.concatenate([simulator.q, simulator.q_dot, simulator.current], axis=-1)
        reached: list[Array] = [now]
        applied: list[Array] = []
        whole = np.ones(len(SHARES), dtype=bool)
        for k, (planned, step, gain) in enumerate(zip(voltage, steps, gains, strict=True)):
            volts = planned + SHARES[:, None] * step - (now - states[k]) @ gain.T
            applied.append(np.ascontiguousarray(np.clip(volts, -limit, limit)))
            simulator.advance(applied[-1], self._settings.substeps)
            now = np.concatenate([simulator.q, simulator.q_dot, simulator.current], axis=-1)
            reached.append(now)
            whole &= simulator.valid
        paths, volts = np.stack(reached, axis=1), np.stack(applied, axis=1)
        cost = np.where(whole, self._cost(paths, volts, smoothing, depth_price), np.inf)
        best = int(np.argmin(cost))
        return paths[best], volts[best], float(cost[best])

    def _depth(self, q: Array) -> Array:
        """Depth of joints and hand below `CLEARANCE` [m], (..., k); negative, zero where they are above it."""
        return np.minimum(elbow_heights(self._settings.parsed_arm, q, self._above) - CLEARANCE, 0.0)

    def _cost(self, states: Array, voltage: Array, smoothing: float, depth_price: float) -> Array:
        q = states[..., 1:, : self._n]
        track = tracking(self._settings, q, self._problem.target, smoothing)[0].sum(axis=-1)
        depth = depth_price / 2.0 * (self._depth(q) ** 2).sum(axis=(-2, -1))
        return track + depth + self._power.cost(states, voltage)

    def _expanded(self, states: Array, smoothing: float, depth_price: float) -> tuple[Array, Array]:
        """Slope, (N, n), and curvature, (N, n, n), in the poses of the states 1..N."""
        q = states[1:, : self._n]
        _, slope, curvature = tracking(self._settings, q, self._problem.target, smoothing)
        if self._above:
            depth = self._depth(q)
            jacobian = constraint_jacobian(self._settings.parsed_arm, q, self._above)
            turned = np.swapaxes(jacobian, -1, -2)
            slope = slope + depth_price * (turned @ depth[..., None])[..., 0]
            curvature = curvature + depth_price * turned @ ((depth < 0.0)[..., None] * jacobian)
        return slope, curvature + REGULAR * self._settings.tracking_weight * np.eye(self._n)

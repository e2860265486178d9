"""Teacher of drawn tasks: Newton's steps from given motions, all tasks of a batch side by side in the simulator.

A step minimises the cost to second order around a motion, under a price on the angles' deviations from it that keeps
the expansion true. A price on voltages alone would let the pose drift where the hand does not tell: steps from a
learned policy's motion then gain a tenth of what they gain so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.control.expansion import MeanPower, tracking
from agents.control.lqr import Linearisation, place, states_of
from agents.learning.newton.law import Law, law
from elbow_gym.interface import Interface
from elbow_gym.kinematics import constraint_jacobian, elbow_heights
from elbow_gym.simulator import Simulator
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

Array = NDArray[np.float64]

SHARES = np.array([1.0, 0.4, 0.1])
"""Shares of a step that are tried side by side [-]."""
CHEAPER, DEARER, REFUSED = 0.25, 3.0, 8.0
"""Factors of the price after a whole step, after a share below `GOOD`, and where no share gains."""
GOOD = 0.3
"""Share of a step that leaves the price as it is [-]."""
LEAST, MOST = 0.01, 1e3
"""Range of the price [1/rad^2]."""
REGULAR = 1e-4
"""Cost of a change of an angle at any price [1/rad^2], which the hand alone would leave free."""
DEPTH = 3e3
"""Price of depth below the table, where joints must not be there [1/m^2]."""
CLEARANCE = 0.002
"""Height above the table from which on depth is counted [m], so that what is left of it is above the table."""


class Tasks(NamedTuple):
    """What B arms are to do in an episode."""

    parameters: Array
    """The kernel's parameter rows, (B, PARAMETER_ROWS, n)."""
    target: Array
    """Targets at the ends of the control periods [m], (B, N, 3)."""

    @classmethod
    def of(cls, env: ElbowArmVectorEnv, observation: NDArray[np.float32]) -> Tasks:
        """The tasks of an environment whose arms have just been reset, with their first observation."""
        interface, arms = Interface(env), np.arange(env.num_envs)
        first = interface.target_angle(interface.decode(observation))
        instants = interface.control_period * np.arange(1, interface.horizon + 1)
        angle = first + instants[:, None] * interface.target_rate
        target = np.swapaxes(interface.target(angle)[0], 0, 1)
        return cls(env.episodes.simulator.parameters(arms), target)


class Motions(NamedTuple):
    """Motions of B arms in an episode."""

    states: Array
    """(q, q_dot, current) at the N + 1 ends of the control periods, (B, N + 1, 3n)."""
    voltage: Array
    """Terminal voltages held in between [V], (B, N, n)."""


class Improved(NamedTuple):
    """Outcome of a step."""

    motions: Motions
    """The better motions; those given where no share of a step gains."""
    law: Law
    """Law that the steps followed, around the given motions."""
    before: Array
    """Costs of the given motions, (B,)."""
    after: Array
    """Costs of the better ones, (B,)."""
    price: Array
    """Prices for the next step [1/rad^2], (B,)."""


class Teacher:
    """Newton's steps of a batch of tasks.

    Args:
        settings: the environment that the tasks are drawn in.
        num_envs: B, the number of tasks.
        above_table: whether joints 3..n and the hand must have z >= 0.
    """

    def __init__(self, settings: Settings, num_envs: int, above_table: bool) -> None:
        arm, self._n = settings.parsed_arm, settings.parsed_arm.n_joints
        self._settings, self._arm, self._power = settings, arm, MeanPower(settings)
        self._linearised = Linearisation(settings, num_envs * settings.horizon, central=False, arms=num_envs)
        # Number n + 1 is the hand.
        self._above = [j for j in range(3, self._n + 2) if j not in settings.elbow_joints] if above_table else []
        self._simulator = Simulator(
            arm,
            settings.elbow_joints,
            num_envs * len(SHARES),
            conditions=settings.conditions,
            timestep=float(settings.substeps.min()),
            integrator=settings.integrator,
        )

    def improve(self, tasks: Tasks, motions: Motions, price: Array, smoothing: float) -> Improved:
        """One step from the motions of the tasks.

        Args:
            tasks: the tasks.
            motions: motions to start from.
            price: price of an angle's square deviation [1/rad^2], (B,).
            smoothing: length that smooths the tracking error [m].

        Raises:
            ArithmeticError: no price lets the expanded cost have a minimum.
        """
        slope, curvature = self._expanded(tasks, motions, smoothing)
        slopes = self._slopes(tasks, motions)
        found, price = self._law(slopes, slope, curvature, motions, price)
        before = self._cost(tasks.target, motions, smoothing)
        tried = self._played(tasks, motions, found)
        cost = self._cost(tasks.target[:, None], tried, smoothing)
        cost = np.where(np.isfinite(cost), cost, np.inf)
        best, arms = cost.argmin(axis=1), np.arange(len(cost))
        gains = cost[arms, best] < before
        chosen = [np.where(gains[:, None, None], new[arms, best], old) for new, old in zip(tried, motions, strict=True)]
        share = np.where(gains, SHARES[best], 0.0)
        factor = np.select([share == 1.0, share >= GOOD, share > 0.0], [CHEAPER, 1.0, DEARER], REFUSED)
        after = np.where(gains, cost[arms, best], before)
        return Improved(Motions(*chosen), found, before, after, np.clip(price * factor, LEAST, MOST))

    def _slopes(self, tasks: Tasks, motions: Motions) -> tuple[Array, Array]:
        arms, periods, n = motions.voltage.shape
        # Arms take turns: the periods of one are apart by the number of them.
        states, voltage = (np.swapaxes(part, 0, 1) for part in (motions.states[:, :-1], motions.voltage))
        slopes = self._linearised(states.reshape(-1, 3 * n), voltage.reshape(-1, n), tasks.parameters)
        in_x, in_v = (np.swapaxes(part.reshape(periods, arms, 3 * n, -1), 0, 1) for part in slopes)
        return in_x, in_v

    def _law(
        self, slopes: tuple[Array, Array], slope: Array, curvature: Array, motions: Motions, price: Array
    ) -> tuple[Law, Array]:
        """The law, and the prices at which it was found."""
        limit = self._settings.voltage_limit
        while (price <= MOST).all():
            priced = curvature + price[:, None, None, None] * np.eye(self._n)
            try:
                return law(slopes, self._power, (slope, priced), motions, limit), price
            except np.linalg.LinAlgError:
                price = price * REFUSED
        raise ArithmeticError(f"price must be at most {MOST} for a step, got {price.max():g}")

    def _played(self, tasks: Tasks, motions: Motions, found: Law) -> Motions:
        """What the simulator makes of `SHARES` of the steps, (B, shares, ...)."""
        simulator, limit, shares = self._simulator, self._settings.voltage_limit, len(SHARES)
        arms, periods, n = motions.voltage.shape
        simulator.set_parameters(np.arange(arms * shares), np.repeat(tasks.parameters, shares, axis=0))
        place(simulator, np.repeat(motions.states[:, 0], shares, axis=0))
        states = np.empty((arms, shares, periods + 1, 3 * n))
        voltage = np.empty((arms, shares, periods, n))
        states[:, :, 0] = motions.states[:, :1]
        for k in range(periods):
            apart = states[:, :, k] - motions.states[:, None, k]
            volts = motions.voltage[:, None, k] - apart @ np.swapaxes(found.gains[:, k], -1, -2)
            volts = np.clip(volts + SHARES[:, None] * found.steps[:, None, k], -limit, limit)
            simulator.advance(np.ascontiguousarray(volts.reshape(-1, n)), self._settings.substeps)
            voltage[:, :, k], states[:, :, k + 1] = volts, states_of(simulator).reshape(arms, shares, -1)
        return Motions(states, voltage)

    def _depth(self, q: Array) -> Array:
        """Depth of joints and hand below `CLEARANCE` [m], (..., k); negative, zero where they are above it."""
        return np.minimum(elbow_heights(self._arm, q, self._above) - CLEARANCE, 0.0)

    def _cost(self, target: Array, motions: Motions, smoothing: float) -> Array:
        """Costs, (...), of motions (..., N + 1, 3n)."""
        q = motions.states[..., 1:, : self._n]
        cost = tracking(self._settings, q, target, smoothing)[0].sum(axis=-1) + self._power.cost(*motions)
        return cost + DEPTH / 2.0 * (self._depth(q) ** 2).sum(axis=(-2, -1)) if self._above else cost

    def _expanded(self, tasks: Tasks, motions: Motions, smoothing: float) -> tuple[Array, Array]:
        """Slope, (B, N, n), and curvature, (B, N, n, n), in the poses of the states 1..N."""
        q = motions.states[:, 1:, : self._n]
        _, slope, curvature = tracking(self._settings, q, tasks.target, smoothing)
        if self._above:
            depth = self._depth(q)
            jacobian = constraint_jacobian(self._arm, q, self._above)
            turned = np.swapaxes(jacobian, -1, -2)
            slope = slope + DEPTH * (turned @ depth[..., None])[..., 0]
            curvature = curvature + DEPTH * turned @ ((depth < 0.0)[..., None] * jacobian)
        return slope, curvature + REGULAR * self._settings.tracking_weight * np.eye(self._n)

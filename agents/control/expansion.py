"""Reward along a trajectory to second order, and the Riccati recursion that minimises it.

The energy is exact, the tracking in Gauss-Newton's form: without the curvature of the hand's path in the joints.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elbow_gym.kinematics import joint_positions
from elbow_gym.parameters import ArmParameters
from elbow_gym.task.settings import Settings

Array = NDArray[np.float64]

ROUNDS = 6
"""Most projected Newton steps that look for the voltages at their limits."""
SOLVED = 1e-9
"""Change of a voltage below which its limit is settled [V]."""


class MeanPower:
    """Energy's part of the cost of a control period, quadratic in the voltage v and the change dx of the state.

    Under a held voltage the mean power is exactly v (v - (K_m dq + L di) / h) / R.
    """

    def __init__(self, settings: Settings) -> None:
        arm, n = settings.parsed_arm, settings.parsed_arm.n_joints
        self.price = settings.energy_weight / arm.of_motors("armature_resistance")
        self.change = np.zeros((n, 3 * n))
        self.change[:, :n] = np.diag(arm.of_motors("joint_torque_constant"))
        self.change[:, 2 * n :] = np.diag(arm.of_motors("armature_inductance"))
        self.change /= settings.control_period

    def cost(self, states: Array, voltage: Array) -> Array:
        """Sum over the periods, (...), of states (..., N + 1, 3n) and voltages [V], (..., N, n)."""
        change = np.diff(states, axis=-2) @ self.change.T
        return (self.price * voltage * (voltage - change)).sum(axis=(-2, -1))

    def slopes(self, a: Array, b: Array, voltage: Array, change: Array) -> tuple[Array, Array]:
        """Slopes in v, (..., n), and in x, (..., 3n), of periods x -> a x + b v with changes of x, (..., 3n)."""
        paid = (self.price * voltage) @ self.change
        in_x = paid - np.einsum("...ij,...i->...j", a, paid)
        return self.price * (2.0 * voltage - change @ self.change.T) - np.einsum("...ij,...i->...j", b, paid), in_x

    def curvatures(self, a: Array, b: Array) -> tuple[Array, Array]:
        """Second derivatives in v and v, (..., n, n), and in v and x, (..., n, 3n), of periods x -> a x + b v."""
        price = self.price[:, None]
        effort = price * (np.eye(len(price)) - self.change @ b)
        return effort + np.swapaxes(effort, -1, -2), -price * (self.change @ a - self.change)


def hand_jacobian(arm: ArmParameters, q: Array) -> Array:
    """Slopes of the hand's position in the joint angles [m/rad], (..., 3, n)."""
    joints = joint_positions(arm, q)
    lever = joints[..., -1:, :] - joints[..., :-1, :]
    axis = np.zeros_like(lever)
    axis[..., 0], axis[..., 1] = -np.sin(q[..., :1]), np.cos(q[..., :1])
    axis[..., 0, :] = [0.0, 0.0, 1.0]
    return np.swapaxes(np.cross(axis, lever), -1, -2)


def tracking(settings: Settings, q: Array, target: Array, smoothing: float) -> tuple[Array, Array, Array]:
    """Tracking's part of the cost, the error e counted as sqrt(e^2 + smoothing^2).

    Args:
        settings: arm and weight.
        q: joint angles [rad], (..., n).
        target: where the hand should be [m], (..., 3).
        smoothing: length that smooths the error [m].

    Returns:
        The cost, (...), its slope in q, (..., n), and its curvature, (..., n, n).
    """
    jacobian = hand_jacobian(settings.parsed_arm, q)
    error = joint_positions(settings.parsed_arm, q)[..., -1, :] - target
    distance = np.sqrt((error**2).sum(axis=-1) + smoothing**2)
    along = error / distance[..., None]
    inner = (np.eye(3) - along[..., :, None] * along[..., None, :]) / distance[..., None, None]
    turned = np.swapaxes(jacobian, -1, -2)
    weight = settings.tracking_weight
    return weight * distance, weight * (turned @ along[..., None])[..., 0], weight * (turned @ inner @ jacobian)


def riccati(
    slopes: tuple[Array, Array],
    power: MeanPower,
    curvature: Array,
    slope: Array | None = None,
    planned: tuple[Array, Array] | None = None,
    limit: float = np.inf,
    stiffness: float = 0.0,
) -> tuple[Array, Array]:
    """Voltages that minimise the expanded cost: v = planned + step - gain (x - planned).

    Args:
        slopes: slopes of x_(k+1) in x_k, (N, 3n, 3n), and in v_k, (N, 3n, n).
        power: energy's part.
        curvature: second derivative of the cost of the states 1..N in q, (N, n, n).
        slope: its first derivative, (N, n).
        planned: states, (N + 1, 3n), and voltages [V], (N, n), that a better plan is sought around; without them the
            plan counts as the best, and all steps are zero.
        limit: largest voltage [V].
        stiffness: price of a step [cost/V^2].

    Returns:
        Steps [V], (N, n), and gains, (N, n, 3n), which are zero for voltages that stay at their limit.

    Raises:
        numpy.linalg.LinAlgError: the expanded cost has no minimum.
    """
    A, B = slopes
    periods, size, n = B.shape
    steps, gains = np.zeros((periods, n)), np.zeros((periods, n, size))
    linear, value = np.zeros(size), np.zeros((size, size))
    efforts, crosses = power.curvatures(A, B)
    if planned is not None:
        pulls, drifts = power.slopes(A, B, planned[1], np.diff(planned[0], axis=0))
    for k in range(periods - 1, -1, -1):
        a, b = A[k], B[k]
        value[:n, :n] += curvature[k]
        ahead = b.T @ value
        effort, cross = efforts[k] + ahead @ b, crosses[k] + ahead @ a
        if planned is None or slope is None:
            gains[k] = np.linalg.solve(effort, cross)
        else:
            linear[:n] += slope[k]
            pull, drift = pulls[k] + b.T @ linear, drifts[k] + a.T @ linear
            room = -limit - planned[1][k], limit - planned[1][k]
            steps[k], gains[k] = _bounded_law(effort + stiffness * np.eye(n), pull, cross, *room)
            linear = drift - gains[k].T @ (effort @ steps[k] + pull) + cross.T @ steps[k]
        mixed = cross.T @ gains[k]
        value = a.T @ value @ a + gains[k].T @ effort @ gains[k] - mixed - mixed.T
        value = (value + value.T) / 2.0
    return steps, gains


def _bounded_law(effort: Array, pull: Array, cross: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """The step u of least pull u + u effort u / 2 in low <= u <= high, and the gains of what is not held at a bound.

    Raises LinAlgError where there is no least one.
    """
    np.linalg.cholesky(effort)
    free_law = np.linalg.solve(effort, np.column_stack([pull, cross]))
    step, gain = -free_law[:, 0], free_law[:, 1:]
    if ((low <= step) & (step <= high)).all():
        return step, gain
    step, free = _bounded(effort, pull, low, high)
    gain = np.zeros_like(cross)
    if free.any():
        gain[free] = np.linalg.solve(effort[np.ix_(free, free)], cross[free])
    return step, gain


def _bounded(effort: Array, pull: Array, low: Array, high: Array) -> tuple[Array, NDArray[np.bool_]]:
    """The least of pull u + u effort u / 2 in low <= u <= high, and which entries are not held at a bound."""
    best, free = np.zeros_like(pull), np.ones(len(pull), dtype=bool)
    for _ in range(ROUNDS):
        uphill = pull + effort @ best
        free = ~(((best <= low + SOLVED) & (uphill > 0.0)) | ((best >= high - SOLVED) & (uphill < 0.0)))
        if not free.any():
            break
        found = best.copy()
        found[free] -= np.linalg.solve(effort[np.ix_(free, free)], uphill[free])
        found = np.clip(found, low, high)
        settled = np.abs(found - best).max() < SOLVED
        best = found
        if settled:
            break
    return best, free

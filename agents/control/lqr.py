"""Time-varying LQR around a trajectory: planned voltages plus feedback of the deviation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.trajectory import Trajectory
from elbow_gym.interface import Environment, Interface
from elbow_gym.kinematics import constraint_jacobian, hand_position
from elbow_gym.simulator import Simulator
from elbow_gym.task.settings import Settings

Array = NDArray[np.float64]

STEP = 1e-5
"""Half the step of the central differences [rad, rad/s, A, V]."""
SMOOTHING = 0.002
"""Length that smooths the tracking error e to sqrt(e^2 + SMOOTHING^2) [m], whose curvature is finite on the target."""
STIFFNESS = 1e-3
"""Cost of a joint's deviation from the trajectory [1/rad^2], which the hand alone would leave free."""


class TimeVaryingLQR:
    """v = v_k - K_k (x - x_k) at period k, with x = (q, q_dot, current), clipped to the supply voltage.

    The gains minimise the reward's second-order expansion along the trajectory under the simulator's own linearised
    control period. Periods are counted from the first call of `predict` on: make one controller per episode, or
    `restart` it.

    Args:
        env: the environment that it will act in, at the trajectory's control frequency.
        trajectory: trajectory to follow.

    Raises:
        ValueError: the trajectory has not one voltage for each of the environment's control periods.
    """

    def __init__(self, env: Environment, trajectory: Trajectory) -> None:
        self._interface = Interface(env)
        horizon = self._interface.horizon
        if len(trajectory.voltage) != horizon:
            raise ValueError(f"trajectory must have {horizon} control periods, got {len(trajectory.voltage)}")
        self._states = np.concatenate([trajectory.q, trajectory.q_dot, trajectory.current], axis=-1)
        self._voltage = trajectory.voltage
        self.gains = lqr_gains(self._interface.settings, trajectory)
        self._period = 0

    def predict(
        self, observation: NDArray[np.float32], *_args: Any, **_kwargs: Any
    ) -> tuple[NDArray[np.float32], None]:
        """Actions (..., n) for observations (..., size); the first call is the episode's start."""
        observed, k = self._interface.decode(observation), self._period
        q = self._interface.joint_angles(observed)
        state = np.concatenate([q, observed["joint_velocity"], observed["current"]], axis=-1)
        voltage = self._voltage[k] - (state - self._states[k]) @ self.gains[k].T
        self._period += 1
        return self._interface.action(voltage), None

    def restart(self) -> None:
        """Starts an episode: the next call of `predict` is its first."""
        self._period = 0


def linearised_periods(settings: Settings, trajectory: Trajectory) -> tuple[Array, Array]:
    """Slopes of x_(k+1) in x_k, (N, 3n, 3n), and in v_k, (N, 3n, n), by central differences of the simulator.

    Deviations of the pose and the rates are projected onto the elbows' plane before they are applied.
    """
    arm, elbows, n = settings.parsed_arm, settings.elbow_joints, settings.parsed_arm.n_joints
    size = 4 * n
    nudge = np.concatenate([np.eye(size), -np.eye(size)]) * STEP
    steps = settings.substeps
    simulator = Simulator(arm, elbows, 2 * size, timestep=float(steps.min()), integrator=settings.integrator)
    states, inputs = [], []
    for q, q_dot, current, voltage in zip(
        trajectory.q[:-1], trajectory.q_dot[:-1], trajectory.current[:-1], trajectory.voltage, strict=True
    ):
        poses, rates = q + nudge[:, :n], q_dot + nudge[:, n : 2 * n]
        if elbows:
            poses = simulator.on_table(poses)
            jacobians = constraint_jacobian(arm, poses, elbows)
            for k, (jacobian, inverse) in enumerate(zip(jacobians, np.linalg.pinv(jacobians), strict=True)):
                rates[k] -= inverse @ (jacobian @ rates[k])
        simulator.reset(poses, rates, current + nudge[:, 2 * n : 3 * n])
        simulator.advance(voltage + nudge[:, 3 * n :], steps)
        after = np.concatenate([simulator.q, simulator.q_dot, simulator.current], axis=-1)
        slope = ((after[:size] - after[size:]) / (2.0 * STEP)).T
        states.append(slope[:, : 3 * n])
        inputs.append(slope[:, 3 * n :])
    return np.stack(states), np.stack(inputs)


def lqr_gains(settings: Settings, trajectory: Trajectory) -> Array:
    """Gains K_k [V/rad, V s/rad, V/A], (N, n, 3n), of the backward Riccati recursion along a trajectory."""
    arm, n = settings.parsed_arm, settings.parsed_arm.n_joints
    periods, h = len(trajectory.voltage), settings.control_period
    A, B = linearised_periods(settings, trajectory)
    resistance, weight = arm.of_motors("armature_resistance"), settings.energy_weight
    # Mean power v (v h - K_m dq - L di) / (R h): its slope in the change of state.
    change = np.zeros((n, 3 * n))
    change[:, :n] = np.diag(arm.of_motors("joint_torque_constant"))
    change[:, 2 * n :] = np.diag(arm.of_motors("armature_inductance"))
    change /= h
    circle = settings.parsed_circle
    target = circle.position(circle.angle(h * np.arange(1, periods + 1), float(circle.phase)))
    gains, P = np.empty((periods, n, 3 * n)), np.zeros((3 * n, 3 * n))
    for k in range(periods - 1, -1, -1):
        P = P + _tracking_curvature(settings, trajectory.q[k + 1], target[k])
        price = (weight / resistance)[:, None]
        effort = price * (np.eye(n) - change @ B[k])
        effort = effort + effort.T + B[k].T @ P @ B[k]
        cross = -price * (change @ (A[k] - np.eye(3 * n))) + B[k].T @ P @ A[k]
        gains[k] = np.linalg.solve(effort, cross)
        P = A[k].T @ P @ A[k] - cross.T @ gains[k]
        P = (P + P.T) / 2.0
    return gains


def _tracking_curvature(settings: Settings, q: Array, target: Array) -> Array:
    """Second derivative of the tracking cost in the state, (3n, 3n), without the curvature of the hand's path."""
    arm, n = settings.parsed_arm, settings.parsed_arm.n_joints
    nudge = np.concatenate([np.eye(n), -np.eye(n)]) * STEP
    hand = hand_position(arm, q + nudge)
    jacobian = ((hand[:n] - hand[n:]) / (2.0 * STEP)).T
    error = hand_position(arm, q) - target
    distance = np.sqrt(error @ error + SMOOTHING**2)
    curvature = np.zeros((3 * n, 3 * n))
    inner = np.eye(3) / distance - np.outer(error, error) / distance**3
    curvature[:n, :n] = settings.tracking_weight * (jacobian.T @ inner @ jacobian + STIFFNESS * np.eye(n))
    return curvature

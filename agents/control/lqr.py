"""Time-varying LQR around a trajectory: planned voltages plus feedback of the deviation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.expansion import MeanPower, riccati, tracking
from agents.control.trajectory import Trajectory
from elbow_gym.interface import Environment, Interface
from elbow_gym.kinematics import constraint_jacobian
from elbow_gym.simulator import Simulator
from elbow_gym.task.settings import Settings

Array = NDArray[np.float64]

STEP = 1e-5
"""Step of the differences to each side [rad, rad/s, A, V]."""
SMOOTHING = 0.002
"""Length that smooths the tracking error e to sqrt(e^2 + SMOOTHING^2) [m], whose curvature is finite on the target."""
STIFFNESS = 1e-3
"""Cost of a joint's deviation from the trajectory [1/rad^2], which the hand alone would leave free."""
TOGETHER = 256
"""Most control periods that are linearised in one batch."""


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
        self._states, self._voltage = trajectory.states, trajectory.voltage
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


class Linearisation:
    """Slopes of a control period by differences of the simulator, all periods of a trajectory in one batch.

    Args:
        settings: the environment.
        periods: control periods of the trajectories, all arms together.
        central: whether differences go to both sides, in twice the time.
        arms: number of arms whose periods take turns.
    """

    def __init__(self, settings: Settings, periods: int, central: bool = True, arms: int = 1) -> None:
        arm, self._steps, n = settings.parsed_arm, settings.substeps, settings.parsed_arm.n_joints
        self._n, self._periods, self._together = n, periods, min(periods, max(1, TOGETHER // arms) * arms)
        self._apart = (2.0 if central else 1.0) * STEP
        self._nudge = np.concatenate([np.eye(4 * n), -np.eye(4 * n) if central else np.zeros((1, 4 * n))]) * STEP
        self._simulator = Simulator(
            arm,
            settings.elbow_joints,
            self._together * len(self._nudge),
            conditions=settings.conditions,
            timestep=float(self._steps.min()),
            integrator=settings.integrator,
        )

    def __call__(self, states: Array, voltage: Array, parameters: Array | None = None) -> tuple[Array, Array]:
        """Slopes of x_(k+1) in x_k, (N, 3n, 3n), and in v_k, (N, 3n, n).

        Deviations of the pose and the rates are projected onto the elbows' plane before they are applied.

        Args:
            states: (q, q_dot, current) at the starts of the periods, (N, 3n).
            voltage: terminal voltages [V], (N, n).
            parameters: parameter rows of the arms whose periods take turns, (arms, PARAMETER_ROWS, n), as
                `Simulator.parameters` has them; those of the settings when None.
        """
        n, size = self._n, 4 * self._n
        if parameters is not None:
            rows = np.repeat(parameters, len(self._nudge), axis=0)
            turns = self._simulator.num_envs // len(rows)
            self._simulator.set_parameters(np.arange(self._simulator.num_envs), np.tile(rows, (turns, 1, 1)))
        slopes = np.empty((self._periods, 3 * n, size))
        # The last batch overlaps the one before where the periods do not divide evenly.
        for first in (*range(0, self._periods - self._together, self._together), self._periods - self._together):
            chosen = slice(first, first + self._together)
            after = self._after(states[chosen], voltage[chosen])
            slopes[chosen] = np.swapaxes(after[:, :size] - after[:, size:], 1, 2) / self._apart
        return slopes[..., : 3 * n], slopes[..., 3 * n :]

    def _after(self, states: Array, voltage: Array) -> Array:
        n, simulator = self._n, self._simulator
        both = np.concatenate([states, voltage], axis=-1)[:, None] + self._nudge
        poses, rates, current, volts = np.split(both.reshape(-1, 4 * n), 4, axis=-1)
        if simulator.elbows:
            poses = simulator.on_table(poses)
            jacobian = constraint_jacobian(simulator.arm, poses, simulator.elbows)
            turned = np.swapaxes(jacobian, -1, -2)
            rates = rates - (turned @ np.linalg.solve(jacobian @ turned, jacobian @ rates[..., None]))[..., 0]
        place(simulator, np.concatenate([poses, rates, current], axis=-1))
        simulator.advance(np.ascontiguousarray(volts), self._steps)
        return states_of(simulator).reshape(len(states), len(self._nudge), 3 * n)


def place(simulator: Simulator, states: Array) -> None:
    """Puts arms into states (q, q_dot, current), (B, 3n), without the checks and the summary of `Simulator.reset`."""
    rows = np.zeros_like(simulator.raw[0])
    rows[:, :3] = states.reshape(simulator.num_envs, 3, -1)
    zero = {"summary": np.zeros(1), "clock": np.zeros(1, dtype=np.int64), "motion": np.zeros(1)}
    simulator.put(np.arange(simulator.num_envs), {"state": rows, **zero})


def states_of(simulator: Simulator) -> Array:
    """States (q, q_dot, current) of the arms, (B, 3n)."""
    return np.concatenate([simulator.q, simulator.q_dot, simulator.current], axis=-1)


def lqr_gains(settings: Settings, trajectory: Trajectory) -> Array:
    """Gains K_k [V/rad, V s/rad, V/A], (N, n, 3n), of the backward Riccati recursion along a trajectory."""
    periods, circle = len(trajectory.voltage), settings.parsed_circle
    slopes = Linearisation(settings, periods)(trajectory.states[:-1], trajectory.voltage)
    instants = settings.control_period * np.arange(1, periods + 1)
    target = circle.position(circle.angle(instants, float(circle.phase)))
    curvature = tracking(settings, trajectory.q[1:], target, SMOOTHING)[2]
    curvature += settings.tracking_weight * STIFFNESS * np.eye(settings.parsed_arm.n_joints)
    return riccati(slopes, MeanPower(settings), curvature)[1]

"""Classical controllers in volts: smooth references, gravity feed-forward and computed torque.

All start from the arm's pose and blend over to the pose that has the hand on the target. They count the time
since the start by their own calls: make one controller per episode, and let all arms of a batch start together.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.control.inverse_dynamics import InverseDynamics
from agents.control.minimum_jerk import minimum_jerk
from agents.control.posture import CIRCLE_POINTS, best_postures, leads_to
from elbow_gym.baselines.pd import PAPER_KD, PAPER_KP
from elbow_gym.checks import positive
from elbow_gym.interface import Environment, Interface
from elbow_gym.kinematics import HandPlacement, nearest_turn, on_table
from elbow_gym.parameters import ArmParameters
from elbow_gym.task.circle import Circle

Array = NDArray[np.float64]

COMPUTED: dict[str, Any] = {
    "control_frequency": 500.0,
    "voltage_limit": 24.0,
    "action_unit": "volt",
}
"""Arguments of the environment for computed torque; those for the PD variants are the PD's."""
REACH_TIME = 0.7
"""Time from the start pose to the target [s]; with less, the yaw would need more than 24 V."""
BANDWIDTH = 15.0
"""Magnitude of both poles of computed torque's tracking error [rad/s]."""
ANGLE_STEP = 1e-4
"""Half the step of the central difference that turns the reference's rates into accelerations [rad of the circle]."""


class Motion(NamedTuple):
    """A pose and its first two derivatives, each (..., n) in rad, rad/s and rad/s^2."""

    q: Array
    q_dot: Array
    q_ddot: Array


class Reference:
    """Minimum-jerk blend from the first observed pose to the pose q_d with the hand on the target (eq. 29).

    Args:
        env: the environment that the arm acts in.
        pose: angles that joints 2..n-2 end in [rad], (n,); the start pose when None.
        reach_time: time from the start to the target [s].
    """

    def __init__(self, env: Environment, pose: ArrayLike | None, reach_time: float) -> None:
        self._interface = interface = Interface(env)
        self._placement = HandPlacement(interface.arm, interface.pose if pose is None else pose)
        self._reach_time = positive("reach_time", reach_time)
        self._start: Array | None = None
        self._calls = 0

    def _desired(self, angle: Array) -> tuple[Array, Array, Array]:
        """q_d [rad] and q_d_dot [rad/s] at the angle, and the change of q_d_dot over 2 ANGLE_STEP around it [rad/s]."""
        angles = np.stack([angle, angle + ANGLE_STEP, angle - ANGLE_STEP])
        q, q_dot = self._placement.joints(*self._interface.target(angles))
        return q[0], q_dot[0], q_dot[1] - q_dot[2]

    def next(self, angle: Array, q: Array) -> Motion:
        """Motion at this control period, for the target's angle on the circle [rad], (...), and q [rad], (..., n)."""
        if self._start is None:
            self._start = q
        rate = np.asarray(self._interface.target_rate)[..., None]
        q_d, q_d_dot, change = self._desired(angle)
        q_d = nearest_turn(q_d, q)
        q_d_ddot = change * (rate / (2.0 * ANGLE_STEP))
        blend, slope, curvature = minimum_jerk(self._calls * self._interface.control_period / self._reach_time)
        slope, curvature = slope / self._reach_time, curvature / self._reach_time**2
        self._calls += 1
        way = q_d - self._start
        return Motion(
            self._start + blend * way,
            slope * way + blend * q_d_dot,
            curvature * way + 2.0 * slope * q_d_dot + blend * q_d_ddot,
        )


class _Following(ABC):
    """Base of the controllers, which observe the state, follow a reference and give clipped actions."""

    def __init__(
        self,
        env: Environment,
        pose: ArrayLike | None = None,
        reach_time: float = REACH_TIME,
        payload: float = 0.0,
    ) -> None:
        self._interface = Interface(env)
        self._inverse = InverseDynamics(self._interface.arm, self._interface.elbows, payload)
        self._reference = Reference(env, pose, reach_time)

    def predict(
        self, observation: NDArray[np.float32], *_args: Any, **_kwargs: Any
    ) -> tuple[NDArray[np.float32], None]:
        """Actions (..., n) for observations (..., size); the first call is the episode's start."""
        observed = self._interface.decode(observation)
        q = self._interface.joint_angles(observed)
        wanted = self._reference.next(self._interface.target_angle(observed), q)
        voltage = self._voltage(wanted, q, observed["joint_velocity"], observed["current"])
        return self._interface.action(voltage), None

    @abstractmethod
    def _voltage(self, wanted: Motion, q: Array, q_dot: Array, current: Array) -> Array: ...


class SmoothPD(_Following):
    """The paper's PD (eq. 27) on a reference without a step.

    Args:
        env: the environment that it will act in, at the PD's control frequency.
        pose: angles that joints 2..n-2 end in [rad], (n,); the start pose when None.
        reach_time: time from the start to the target [s].
    """

    def _voltage(self, wanted: Motion, q: Array, q_dot: Array, current: Array) -> Array:
        return PAPER_KP * (wanted.q - q) + PAPER_KD * (wanted.q_dot - q_dot)


class GravityPD(SmoothPD):
    """`SmoothPD` plus the voltage that holds the reference's pose at rest with least copper loss.

    That voltage carries gravity as far as the elbows do not: R i with the elbow forces of `InverseDynamics.drive`.
    """

    def _voltage(self, wanted: Motion, q: Array, q_dot: Array, current: Array) -> Array:
        holding = self._inverse.resistance * self._inverse.hold(wanted.q).current
        return super()._voltage(wanted, q, q_dot, current) + holding


class ComputedTorque(_Following):
    """Inverse dynamics of the arm, the elbows and the motors, with both error poles at -BANDWIDTH.

    The asked acceleration q_d_ddot + 2 b (q_d_dot - q_dot) + b^2 (q_d - q), projected onto the elbows' plane, gives
    currents by inverse dynamics with the elbow forces of least copper loss; the voltage brings the armatures there
    within one control period.

    Args:
        env: the environment that it will act in; `COMPUTED` has its arguments.
        pose: angles that joints 2..n-2 end in [rad], (n,); the start pose when None.
        reach_time: time from the start to the target [s].
        payload: mass at the hand that it is told of [kg].
    """

    def _voltage(self, wanted: Motion, q: Array, q_dot: Array, current: Array) -> Array:
        asked = wanted.q_ddot + 2.0 * BANDWIDTH * (wanted.q_dot - q_dot) + BANDWIDTH**2 * (wanted.q - q)
        drive = self._inverse.drive(q, q_dot, self._inverse.held_acceleration(q, q_dot, asked))
        return self._inverse.held_voltage(q_dot, current, drive.current, self._interface.control_period)


@cache
def economical_pose(arm: ArmParameters, elbows: tuple[int, ...], circle: Circle, payload: float = 0.0) -> Array:
    """The pose [rad], (n,), whose idle joints hold the arm over the circle with least copper loss, none below z = 0.

    Only poses count that the arm can move to with its elbows on the table; the start pose where none is found.
    """
    start = on_table(arm, arm.nominal_pose, elbows)
    try:
        postures = best_postures(arm, elbows, circle, payload=payload)
    # No posture serves the whole circle with all joints above the table.
    except ValueError:
        return start
    return next((posture.pose for posture in postures if leads_to(arm, elbows, posture.pose)), start)


@cache
def task_pose(arm: ArmParameters, elbows: tuple[int, ...], circle: Circle, payload: float = 0.0) -> Array:
    """A pose [rad], (n,), from which the last two links and the yaw follow a circle without ranges.

    The start pose where that is one; otherwise the `economical_pose`, which is for points around the circle.
    """
    start = on_table(arm, arm.nominal_pose, elbows)
    try:
        HandPlacement(arm, start).joints(circle.position(np.linspace(0.0, 2.0 * np.pi, 73)))
    # The last two links do not cover the circle from there.
    except ValueError:
        around = replace(circle, radius=circle.radius / math.cos(math.pi / CIRCLE_POINTS))
        return economical_pose(arm, elbows, around, payload)
    return start


def economical_computed_torque(env: Environment) -> ComputedTorque:
    """`ComputedTorque` that moves to `economical_pose` first."""
    interface = Interface(env)
    return ComputedTorque(env, economical_pose(interface.arm, interface.elbows, interface.circle.widest))

"""Torques, currents and voltages that a motion needs: the equations of motion solved for them, for whole batches.

Lagrange's equations in absolute pitch, where the mass matrix of the plane is S_ab cos(phi_a - phi_b): a third
derivation beside the paper's Newton-Euler pass and the kernel's recursion. They are written in products alone, so that
the same lines serve NumPy batches and CasADi's symbols.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elbow_gym.parameters import ArmParameters

Array = NDArray[np.float64]


class Drive(NamedTuple):
    """Currents of the motors and forces of the table that a motion needs."""

    current: Array
    """Armature currents [A], (..., n)."""
    elbow_force: Array
    """f_n of the table on each elbow along +z [N], (..., p); negative when the table pulls."""


class InverseDynamics:
    """Torques, currents and voltages of one arm's motions.

    Args:
        arm: the arm.
        elbows: joint numbers held at z = 0.
        payload: point mass at the hand [kg], a number or a symbol of CasADi's.
    """

    def __init__(self, arm: ArmParameters, elbows: Sequence[int] = (), payload: Any = 0.0) -> None:
        n = arm.n_joints
        self.arm, self.elbows, self.payload = arm, tuple(elbows), payload
        self.torque_constant = arm.of_motors("joint_torque_constant")
        self.resistance = arm.of_motors("armature_resistance")
        self.inductance = arm.of_motors("armature_inductance")
        friction = np.array(arm.joint_viscous_friction) + arm.of_motors("reflected_viscous_friction")
        # Diagonal matrices, since a CasADi row times a plain vector is no elementwise product.
        self._rotor, self._friction = np.diag(arm.of_motors("reflected_inertia")), np.diag(friction)
        length, mass = arm.of_links("length"), arm.of_links("mass")
        # phi = q @ to_pitch: joint 1 does not pitch.
        self.to_pitch = np.triu(np.ones((n, n)))
        self.to_pitch[0] = 0.0
        self._yaw, self._base = np.eye(n)[:, :1], np.eye(n)[:1]
        # Row k: how far along each link the centre of mass of link k lies.
        lever = np.tril(np.ones((n, n)), -1) * length + np.diag(length / 2.0)
        # The payload is the last link's end: a whole length along every link, and nothing that turns.
        self._coupling = payload * np.outer(length, length) + lever.T @ (mass[:, None] * lever)
        transverse, axial = arm.of_links("transverse_inertia"), arm.of_links("axial_inertia")
        self._transverse, self._difference = np.diag(transverse), np.diag(transverse - axial)
        self._axial = float(axial.sum())
        self._weight = payload * np.diag(arm.gravity * length) + np.diag(arm.gravity * (mass @ lever))
        # Columns: how much of each link's height lies below an elbow.
        self._below = np.array([[length[k] * (k + 1 < e) for e in self.elbows] for k in range(n)]).reshape(n, -1)

    def loaded(self, payload: Any) -> InverseDynamics:
        """The same arm with another payload [kg], a number or a symbol of CasADi's."""
        return InverseDynamics(self.arm, self.elbows, payload)

    def torque(self, q: Any, q_dot: Any, q_ddot: Any) -> Any:
        """Torque of a motion without elbows [N m], (..., n), rotor inertia and all friction in.   Eqs 22-25.

        Args:
            q: relative joint angles [rad], (..., n), NumPy arrays or CasADi rows (1, n).
            q_dot: rates [rad/s].
            q_ddot: accelerations [rad/s^2].
        """
        phi, w, alpha = q @ self.to_pitch, q_dot @ self.to_pitch, q_ddot @ self.to_pitch
        s, c = np.sin(phi), np.cos(phi)
        yaw_rate, yaw_acceleration = q_dot @ self._yaw, q_ddot @ self._yaw
        reach = s @ self._coupling
        # Half the slope of the yaw's inertia: d I_psi / d phi / 2.
        flat = reach + s @ self._difference
        swing = c * flat
        along = (c * alpha - s * w * w) @ self._coupling
        across = (s * alpha + c * w * w) @ self._coupling
        pitch = c * along + s * across + alpha @ self._transverse - yaw_rate * yaw_rate * swing - s @ self._weight
        ones = np.ones((self.arm.n_joints, 1))
        yaw_inertia = (s * flat) @ ones + self._axial
        yaw = yaw_inertia * yaw_acceleration + 2.0 * ((swing * w) @ ones) * yaw_rate
        links = pitch @ self.to_pitch.T + yaw @ self._base
        return links + q_ddot @ self._rotor + q_dot @ self._friction

    def holding_torque(self, q: Array) -> Array:
        """Torque of standing still without elbows [N m], (..., n): `torque` without rates and accelerations."""
        return -(np.sin(q @ self.to_pitch) @ self._weight) @ self.to_pitch.T

    def elbow_heights(self, q: Any) -> Any:
        """C(q): height of each elbow [m], (..., p).   Eq. 18."""
        return np.cos(q @ self.to_pitch) @ self._below

    def elbow_speeds(self, q: Any, q_dot: Any) -> Any:
        """J_c q_dot: rate of each elbow's height [m/s], (..., p).   Eq. 17."""
        return -(np.sin(q @ self.to_pitch) * (q_dot @ self.to_pitch)) @ self._below

    def elbow_torque(self, q: Any, elbow_force: Any) -> Any:
        """J_c^T f [N m], (..., n): joint torques of forces on the elbows [N], (..., p).   Eq. 17."""
        return -(np.sin(q @ self.to_pitch) * (elbow_force @ self._below.T)) @ self.to_pitch.T

    def held_acceleration(self, q: Array, q_dot: Array, q_ddot: Array) -> Array:
        """The accelerations nearest to `q_ddot` that keep the elbows at z = 0 [rad/s^2], (..., n).   Eq. 15."""
        if not self.elbows:
            return q_ddot
        unit = self._unit_torques(q)
        rise = (q_ddot[..., None, :] @ unit)[..., 0, :] - (
            np.cos(q @ self.to_pitch) * (q_dot @ self.to_pitch) ** 2
        ) @ self._below
        share = np.linalg.solve(np.swapaxes(unit, -1, -2) @ unit, rise[..., None])
        return q_ddot - (unit @ share)[..., 0]

    def _unit_torques(self, q: Array) -> Array:
        """J_c^T [m/rad], (..., n, p): the torques of one newton under each elbow."""
        return np.stack([self.elbow_torque(q, force) for force in np.eye(len(self.elbows))], axis=-1)

    def drive(self, q: ArrayLike, q_dot: ArrayLike, q_ddot: ArrayLike) -> Drive:
        """Currents of a motion that keeps the elbows down, with the elbow forces of least copper loss.

        K_m i = tau - J_c^T f has one free force per elbow; f minimises sum R i^2. The kernel then finds the same
        forces from these currents, provided that `q_ddot` keeps the elbows at z = 0.

        Args:
            q: relative joint angles [rad], (..., n).
            q_dot: rates [rad/s], (..., n).
            q_ddot: accelerations [rad/s^2], (..., n).
        """
        q = np.asarray(q, dtype=np.float64)
        return self._drive(q, self.torque(q, np.asarray(q_dot, dtype=np.float64), np.asarray(q_ddot, dtype=np.float64)))

    def hold(self, q: Array) -> Drive:
        """Currents that hold a pose [rad], (..., n), at rest: those of `drive` without rates and accelerations."""
        return self._drive(q, self.holding_torque(q))

    def _drive(self, q: Array, torque: Array) -> Drive:
        if not self.elbows:
            return Drive(torque / self.torque_constant, np.zeros((*q.shape[:-1], 0)))
        unit = self._unit_torques(q)
        price = (self.resistance / self.torque_constant**2)[:, None]
        gram = np.swapaxes(unit, -1, -2) @ (price * unit)
        force = np.linalg.solve(gram, np.swapaxes(unit, -1, -2) @ (price * torque[..., None]))
        return Drive((torque - (unit @ force)[..., 0]) / self.torque_constant, force[..., 0])

    def voltage(self, q_dot: ArrayLike, current: ArrayLike, current_dot: ArrayLike = 0.0) -> Array:
        """Terminal voltage v = R i + K_m q_dot + L di/dt [V], (..., n).   Eq. 10."""
        return np.asarray(
            self.resistance * np.asarray(current)
            + self.torque_constant * np.asarray(q_dot)
            + self.inductance * np.asarray(current_dot)
        )

    def held_voltage(self, q_dot: ArrayLike, current: ArrayLike, wanted: ArrayLike, period: float) -> Array:
        """The constant voltage [V], (..., n), that takes `current` to `wanted` [A] in `period` [s] at fixed rates."""
        kept = np.exp(-self.resistance * period / self.inductance)
        final = (np.asarray(wanted) - kept * np.asarray(current)) / (1.0 - kept)
        return self.voltage(q_dot, final)

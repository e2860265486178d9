"""The paper as printed: one arm, NumPy, one function per equation. Slow and clear on purpose.

The compiled fast form in `kernel/` is derived another way; tests prove the two equal.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.checks import non_negative
from elbow_gym.contact import contact_forces, contact_torque, elbow_drag
from elbow_gym.kinematics import constraint_bias, constraint_jacobian
from elbow_gym.motors import armature_resistance, back_emf, coulomb_friction, motor_torque
from elbow_gym.parameters import ArmParameters, Array
from elbow_gym.table import TableParameters

__all__ = [
    "Acceleration",
    "back_emf",
    "bias_forces",
    "constraint_bias",
    "constraint_jacobian",
    "forward_dynamics",
    "inverse_dynamics",
    "mass_matrix",
    "motor_torque",
]


class Acceleration(NamedTuple):
    """The unknowns of the multi-elbow system.   Eq. 21."""

    q_ddot: Array
    """Joint accelerations [rad/s^2], shape (n,)."""
    elbow_force: Array
    """f_n of the table on each elbow along +z [N], shape (p,); negative when the table pulls."""
    current_dot: Array
    """Rates of the armature currents [A/s], shape (n,)."""


def _rotations(q: Array) -> Array:
    """Rotation of each link's frame against the link before it, shape (n, 3, 3). Joint 1 about z, the rest about y."""
    cos, sin = np.cos(q), np.sin(q)
    rotations = np.zeros((q.size, 3, 3))
    rotations[0] = [[cos[0], -sin[0], 0.0], [sin[0], cos[0], 0.0], [0.0, 0.0, 1.0]]
    for k in range(1, q.size):
        rotations[k] = [[cos[k], 0.0, sin[k]], [0.0, 1.0, 0.0], [-sin[k], 0.0, cos[k]]]
    return rotations


def _cross(a: Array, b: Array) -> Array:
    """The product a x b of vectors, (3,). NumPy's own looks for axes first, which takes nine tenths of a pass."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def inverse_dynamics(
    arm: ArmParameters, q: ArrayLike, q_dot: ArrayLike, q_ddot: ArrayLike, gravity: float | None = None
) -> Array:
    """INV[q, q_dot, q_ddot, g]: the generalised torque tau~ of a motion [N m], shape (n,).   Eqs 22-24.

    One Newton-Euler pass, links outward then inward, with rotor inertia and all friction in:
    tau~_k = z_k . n_k + J_m q_ddot_k + (D + D_m) q_dot_k (eq. 23). Link frames have z along the link.

    Args:
        arm: the arm.
        q: relative joint angles [rad], shape (n,).
        q_dot: rates [rad/s], shape (n,).
        q_ddot: accelerations [rad/s^2], shape (n,).
        gravity: g [m/s^2]; the arm's own when None.
    """
    q, q_dot, q_ddot = (np.asarray(value, dtype=np.float64) for value in (q, q_dot, q_ddot))
    rotations = _rotations(q)
    axes = np.array([[0.0, 0.0, 1.0]] + [[0.0, 1.0, 0.0]] * (arm.n_joints - 1))
    omega, omega_dot = np.zeros(3), np.zeros(3)
    # Gravity enters as an upward acceleration of the base.
    acceleration = np.array([0.0, 0.0, arm.gravity if gravity is None else gravity])
    forces, moments = np.zeros((arm.n_joints, 3)), np.zeros((arm.n_joints, 3))

    for k, link in enumerate(arm.links):
        to_link = rotations[k].T
        omega_dot = to_link @ omega_dot + _cross(to_link @ omega, axes[k] * q_dot[k]) + axes[k] * q_ddot[k]
        omega = to_link @ omega + axes[k] * q_dot[k]
        acceleration = to_link @ acceleration
        span = np.array([0.0, 0.0, link.length])
        spin = _cross(omega_dot, span) + _cross(omega, _cross(omega, span))
        inertia = np.diag([link.transverse_inertia, link.transverse_inertia, link.axial_inertia])
        forces[k] = link.mass * (acceleration + spin / 2.0)
        moments[k] = inertia @ omega_dot + _cross(omega, inertia @ omega)
        acceleration = acceleration + spin

    torque = np.zeros(arm.n_joints)
    force, moment = np.zeros(3), np.zeros(3)
    for k in range(arm.n_joints - 1, -1, -1):
        span = np.array([0.0, 0.0, arm.links[k].length])
        if k + 1 < arm.n_joints:
            force, moment = rotations[k + 1] @ force, rotations[k + 1] @ moment
        moment = moments[k] + moment + _cross(span / 2.0, forces[k]) + _cross(span, force)
        force = forces[k] + force
        torque[k] = axes[k] @ moment
    friction = np.array(arm.joint_viscous_friction) + arm.of_motors("reflected_viscous_friction")
    return torque + arm.of_motors("reflected_inertia") * q_ddot + friction * q_dot


def mass_matrix(arm: ArmParameters, q: ArrayLike) -> Array:
    """M_J = M(q) + J_m [kg m^2], shape (n, n), column by column: INV[q, 0, e_i, 0].   Eq. 26."""
    zero, unit = np.zeros(arm.n_joints), np.eye(arm.n_joints)
    return np.stack([inverse_dynamics(arm, q, zero, unit[i], 0.0) for i in range(arm.n_joints)], axis=1)


def bias_forces(arm: ArmParameters, q: ArrayLike, q_dot: ArrayLike) -> Array:
    """B_J = H + G + (D + D_m) q_dot [N m], shape (n,): INV[q, q_dot, 0, g].   Eq. 25."""
    return inverse_dynamics(arm, q, q_dot, np.zeros(arm.n_joints))


def forward_dynamics(
    arm: ArmParameters,
    q: ArrayLike,
    q_dot: ArrayLike,
    current: ArrayLike,
    voltage: ArrayLike,
    elbows: Sequence[int] = (),
    *,
    table: TableParameters | None = None,
    elbow_friction: float = 0.0,
    temperature_rise: ArrayLike = 0.0,
) -> Acceleration:
    """Solves the (2n + p) system M* [q_ddot, f_n, i_dot] = b of arm, elbows and motors.   Eqs 17-21.

    Args:
        arm: the arm.
        q: relative joint angles [rad], shape (n,). Not required to lie on the table.
        q_dot: rates [rad/s], shape (n,).
        current: armature currents i [A], shape (n,).
        voltage: terminal voltages v [V], shape (n,).
        elbows: joint numbers held at z = 0, bilateral, and frictionless unless `elbow_friction` says otherwise.
        table: the compliant table under joints 3..n and the hand, if there is one.
        elbow_friction: Coulomb's coefficient of the elbows on their plane [-], where it pushes on them.
        temperature_rise: of the windings above the ambient [K], shape (n,) or one for all.

    Raises:
        ValueError: `elbow_friction` is negative.
        numpy.linalg.LinAlgError: the elbows' constraints are linearly dependent at `q`.
    """
    n, p = arm.n_joints, len(elbows)
    current, voltage = np.asarray(current, dtype=np.float64), np.asarray(voltage, dtype=np.float64)
    jacobian = constraint_jacobian(arm, q, elbows)
    matrix = np.zeros((2 * n + p, 2 * n + p))
    matrix[:n, :n] = mass_matrix(arm, q)
    matrix[:n, n : n + p] = -jacobian.T
    matrix[n : n + p, :n] = jacobian
    matrix[n + p :, n + p :] = np.diag(arm.of_motors("armature_inductance"))
    right = np.concatenate(
        [
            arm.of_motors("joint_torque_constant") * current - bias_forces(arm, q, q_dot),
            -constraint_bias(arm, q, q_dot, elbows),
            voltage - armature_resistance(arm, temperature_rise) * current - back_emf(arm, q_dot),
        ]
    )
    right[:n] += coulomb_friction(arm, q_dot)
    if table is not None:
        right[:n] += contact_torque(arm, q, contact_forces(arm, table, q, q_dot))
    if non_negative("elbow_friction", elbow_friction) > 0.0:
        drag = elbow_drag(arm, q, q_dot, elbows, elbow_friction)
        right[:n] += drag @ np.maximum(_rubbing_force(matrix, right, drag), 0.0)
    solution = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    return Acceleration(solution[:n], solution[n : n + p], solution[n + p :])


def _rubbing_force(matrix: Array, right: Array, drag: Array) -> Array:
    """Elbow forces f_n [N], shape (p,), that agree with the friction they cause on the elbows that push.

    Friction enters the columns of the *active* elbows, at first those that push without friction, then those that
    push with it, until they stay the same. Under strong friction they may not; the result is then the one with the
    friction of the last round, which still opposes the sliding.
    """
    n, p = drag.shape
    force = np.linalg.solve(matrix, right)[n : n + p]
    for _ in range(p + 2):
        active = force > 0.0
        rubbing = matrix.copy()
        rubbing[:n, n : n + p] -= drag * active
        force = np.linalg.solve(rubbing, right)[n : n + p]
        if ((force > 0.0) == active).all():
            break
    return np.asarray(force, dtype=np.float64)

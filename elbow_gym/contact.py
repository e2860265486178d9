"""Forces of the table on the arm: the compliant table under every joint, and friction under the rigid elbows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.kinematics import constraint_jacobian, elbow_heights, radial_jacobian, radii
from elbow_gym.parameters import ArmParameters, Array
from elbow_gym.table import FRICTION_VELOCITY, TableParameters


def contact_points(arm: ArmParameters) -> tuple[int, ...]:
    """The n - 1 points that may touch the table: joints 3..n and the hand, which counts as joint n + 1."""
    return tuple(range(3, arm.n_joints + 2))


def sliding_velocity(arm: ArmParameters, q: ArrayLike, q_dot: ArrayLike, joints: Sequence[int]) -> Array:
    """Velocity of joints along the table [m/s], shape (p, 2): radial rho_dot and tangential rho psi_dot."""
    radial = radial_jacobian(arm, q, joints) @ np.asarray(q_dot, dtype=np.float64)
    return np.stack([radial, radii(arm, q, joints) * np.asarray(q_dot, dtype=np.float64)[0]], axis=1)


def _smooth_direction(velocity: Array, friction_velocity: float) -> Array:
    # v / sqrt(|v|^2 + v_s^2): Coulomb's direction of sliding, linear in v where v is small.
    return velocity / np.sqrt((velocity**2).sum(axis=1, keepdims=True) + friction_velocity**2)


def _depth(arm: ArmParameters, q: ArrayLike) -> Array:
    return np.maximum(-elbow_heights(arm, q, contact_points(arm)), 0.0)


def _rise(arm: ArmParameters, q: ArrayLike, q_dot: ArrayLike) -> Array:
    return constraint_jacobian(arm, q, contact_points(arm)) @ np.asarray(q_dot, dtype=np.float64)


def contact_forces(arm: ArmParameters, table: TableParameters, q: ArrayLike, q_dot: ArrayLike) -> Array:
    """Forces of the compliant table on each contact point [N], shape (n - 1, 3): radial, tangential, normal (+z).

    With the depth delta = max(-z, 0) and v = (rho_dot, rho psi_dot):
    f_n = max(0, k delta (1 - c z_dot)) (Hunt-Crossley), (f_rho, f_psi) = -mu f_n v / sqrt(|v|^2 + v_s^2).

    Args:
        arm: the arm.
        table: k, c, mu and v_s.
        q: relative joint angles [rad], shape (n,).
        q_dot: rates [rad/s], shape (n,).
    """
    spring = table.stiffness * _depth(arm, q)
    normal = np.maximum(spring * (1.0 - table.dissipation * _rise(arm, q, q_dot)), 0.0)
    direction = _smooth_direction(sliding_velocity(arm, q, q_dot, contact_points(arm)), table.friction_velocity)
    return np.concatenate([-table.friction * normal[:, None] * direction, normal[:, None]], axis=1)


def contact_torque(arm: ArmParameters, q: ArrayLike, force: Array) -> Array:
    """Generalised torque J^T f of forces (n - 1, 3) on the contact points [N m], shape (n,)."""
    points = contact_points(arm)
    torque = force[:, 0] @ radial_jacobian(arm, q, points) + force[:, 2] @ constraint_jacobian(arm, q, points)
    torque[0] += force[:, 1] @ radii(arm, q, points)
    return torque


def contact_energy(arm: ArmParameters, table: TableParameters, q: ArrayLike) -> Array:
    """Elastic energy that the table holds under each contact point [J], shape (n - 1,): k delta^2 / 2."""
    return table.stiffness * _depth(arm, q) ** 2 / 2.0


def contact_loss(arm: ArmParameters, table: TableParameters, q: ArrayLike, q_dot: ArrayLike) -> Array:
    """Power that each contact turns into heat [W], shape (n - 1,), never negative.

    (f_n - k delta) (-z_dot) - (f_rho rho_dot + f_psi rho psi_dot): what the force takes beyond the elastic energy.
    """
    force = contact_forces(arm, table, q, q_dot)
    damping = (table.stiffness * _depth(arm, q) - force[:, 2]) * _rise(arm, q, q_dot)
    return damping - (force[:, :2] * sliding_velocity(arm, q, q_dot, contact_points(arm))).sum(axis=1)


def elbow_friction_force(
    arm: ArmParameters, q: ArrayLike, q_dot: ArrayLike, elbows: Sequence[int], elbow_force: ArrayLike, friction: float
) -> Array:
    """Friction f_t on the rigid elbows [N], shape (p, 2): radial and tangential.   Eq. 13.

    -mu_e max(f_n, 0) v / sqrt(|v|^2 + v_s^2), v = (rho_dot, rho psi_dot), v_s = FRICTION_VELOCITY: an elbow that pulls
    has no friction.

    Args:
        arm: the arm.
        q: relative joint angles [rad], shape (n,).
        q_dot: rates [rad/s], shape (n,).
        elbows: joint numbers.
        elbow_force: f_n along +z [N], shape (p,).
        friction: mu_e [-].
    """
    direction = _smooth_direction(sliding_velocity(arm, q, q_dot, elbows), FRICTION_VELOCITY)
    pushing = np.maximum(np.asarray(elbow_force, dtype=np.float64), 0.0)
    return -friction * pushing[:, None] * direction


def elbow_drag(arm: ArmParameters, q: ArrayLike, q_dot: ArrayLike, elbows: Sequence[int], friction: float) -> Array:
    """Friction's generalised torque per newton of f_n on each elbow [N m/N], shape (n, p): J_t^T f_t / f_n."""
    force = elbow_friction_force(arm, q, q_dot, elbows, np.ones(len(elbows)), friction)
    drag = radial_jacobian(arm, q, elbows).T * force[:, 0]
    drag[0] += radii(arm, q, elbows) * force[:, 1]
    return drag

"""Positions of joints and hand, heights, radii and Jacobians of elbows, and inverse kinematics.

Angles: `q` is relative; the pitch phi_k = q_2 + ... + q_k is measured from the vertical. Link k runs
l_k sin(phi_k) outward along the radius that the yaw q_1 selects and l_k cos(phi_k) up.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.parameters import ArmParameters, Array


def pitches(q: ArrayLike) -> Array:
    """Absolute pitch phi [rad] from the vertical, shape (..., n): zero for link 1, cumulative after it."""
    phi = np.array(q, dtype=np.float64)
    phi[..., 0] = 0.0
    return np.cumsum(phi, axis=-1)


def joint_positions(arm: ArmParameters, q: ArrayLike) -> Array:
    """Positions of joints 1..n and, last, the hand [m], shape (..., n + 1, 3), in world x, y, z."""
    q = np.asarray(q, dtype=np.float64)
    phi, length = pitches(q), arm.of_links("length")
    positions = np.zeros((*q.shape[:-1], arm.n_joints + 1, 3))
    rho = np.cumsum(length * np.sin(phi), axis=-1)
    positions[..., 1:, 0] = rho * np.cos(q[..., :1])
    positions[..., 1:, 1] = rho * np.sin(q[..., :1])
    positions[..., 1:, 2] = np.cumsum(length * np.cos(phi), axis=-1)
    return positions


def hand_position(arm: ArmParameters, q: ArrayLike) -> Array:
    """Position of the hand, the end of the last link [m], shape (..., 3), in world x, y, z."""
    return joint_positions(arm, q)[..., -1, :]


def elbow_heights(arm: ArmParameters, q: ArrayLike, elbows: Sequence[int]) -> Array:
    """C(q): height z of each elbow joint above the table [m], shape (..., p).   Eq. 18."""
    return joint_positions(arm, q)[..., [e - 1 for e in elbows], 2]


def constraint_jacobian(arm: ArmParameters, q: ArrayLike, elbows: Sequence[int]) -> Array:
    """J_c = dC/dq [m/rad], shape (p, n): raising joint j pitches every link from j to the elbow.   Eq. 17."""
    slope = -arm.of_links("length") * np.sin(pitches(q))
    jacobian = np.zeros((len(elbows), arm.n_joints))
    for row, elbow in enumerate(elbows):
        jacobian[row, 1 : elbow - 1] = np.cumsum(slope[1 : elbow - 1][::-1])[::-1]
    return jacobian


def radii(arm: ArmParameters, q: ArrayLike, joints: Sequence[int]) -> Array:
    """Signed distance rho of joints from the yaw axis, along the arm's radius [m], shape (p,); n + 1 is the hand."""
    rho = np.cumsum(arm.of_links("length") * np.sin(pitches(q)))
    return rho[[joint - 2 for joint in joints]]


def radial_jacobian(arm: ArmParameters, q: ArrayLike, joints: Sequence[int]) -> Array:
    """J_rho = d rho/dq [m/rad], shape (p, n), of joints; n + 1 is the hand."""
    slope = arm.of_links("length") * np.cos(pitches(q))
    jacobian = np.zeros((len(joints), arm.n_joints))
    for row, joint in enumerate(joints):
        jacobian[row, 1 : joint - 1] = np.cumsum(slope[1 : joint - 1][::-1])[::-1]
    return jacobian


def constraint_bias(arm: ArmParameters, q: ArrayLike, q_dot: ArrayLike, elbows: Sequence[int]) -> Array:
    """J_c_dot q_dot = q_dot^T (dJ_c/dq) q_dot [m/s^2], shape (p,).   Eq. 15 with the sign of its left side."""
    centripetal = -arm.of_links("length") * np.cos(pitches(q)) * pitches(q_dot) ** 2
    return np.array([centripetal[1 : elbow - 1].sum() for elbow in elbows])


def inverse_kinematics(
    arm: ArmParameters, pose: ArrayLike, position: ArrayLike, velocity: ArrayLike | None = None
) -> tuple[Array, Array]:
    """Joint angles and rates that put the hand on a target by joints 1, n-1 and n alone.   Eq. 29.

    Args:
        arm: the arm.
        pose: angles [rad], shape (n,), that joints 2..n-2 keep.
        position: hand target [m], shape (..., 3).
        velocity: its rate [m/s], same shape; zero when None.

    Returns:
        q_d [rad] and its exact derivative [rad/s], each (..., n), on the branch q_n > 0, with q_1 = atan2(y, x).

    Raises:
        ValueError: the target is out of reach, with the distance missing.
    """
    pose, position = np.asarray(pose, dtype=np.float64), np.asarray(position, dtype=np.float64)
    velocity = np.zeros_like(position) if velocity is None else np.asarray(velocity, dtype=np.float64)
    length = arm.of_links("length")
    inner, outer = length[-2], length[-1]
    phi = pitches(pose)
    base_rho, base_z = (length[:-2] * np.sin(phi[:-2])).sum(), (length[:-2] * np.cos(phi[:-2])).sum()

    x, y, z = position[..., 0], position[..., 1], position[..., 2]
    rho = np.hypot(x, y)
    d_rho, d_z = rho - base_rho, z - base_z
    distance = np.hypot(d_rho, d_z)
    missing = np.maximum(distance - (inner + outer), abs(inner - outer) - distance).max()
    if not missing <= 0.0:
        raise ValueError(f"position must be within reach of the last two links, got a point {missing:.4g} m outside it")
    cosine = (distance**2 - inner**2 - outer**2) / (2.0 * inner * outer)
    bend = np.arccos(np.clip(cosine, -1.0, 1.0))
    phi_inner = np.arctan2(d_rho, d_z) - np.arctan2(outer * np.sin(bend), inner + outer * np.cos(bend))
    phi_outer = phi_inner + bend

    q = np.broadcast_to(pose, (*position.shape[:-1], arm.n_joints)).copy()
    q[..., 0] = np.arctan2(y, x)
    # Turns are taken out so that the angle stays the one nearest to the pose's.
    q[..., -2] = pose[-2] + np.mod(phi_inner - phi[-2] + np.pi, 2.0 * np.pi) - np.pi
    q[..., -1] = bend

    rho_dot = (x * velocity[..., 0] + y * velocity[..., 1]) / rho
    z_dot = velocity[..., 2]
    # rho_dot = l1 cos(phi1) w1 + l2 cos(phi2) w2 and z_dot = -l1 sin(phi1) w1 - l2 sin(phi2) w2, solved for w.
    w_inner = (rho_dot * np.sin(phi_outer) + z_dot * np.cos(phi_outer)) / (inner * np.sin(bend))
    w_outer = -(rho_dot * np.sin(phi_inner) + z_dot * np.cos(phi_inner)) / (outer * np.sin(bend))
    q_dot = np.zeros_like(q)
    q_dot[..., 0] = (x * velocity[..., 1] - y * velocity[..., 0]) / rho**2
    q_dot[..., -2] = w_inner
    q_dot[..., -1] = w_outer - w_inner
    return q, q_dot

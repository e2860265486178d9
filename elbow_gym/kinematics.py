"""Positions of joints and hand, heights, radii and Jacobians of elbows, and inverse kinematics.

Angles: `q` is relative; the pitch phi_k = q_2 + ... + q_k is measured from the vertical. Link k runs
l_k sin(phi_k) outward along the radius that the yaw q_1 selects and l_k cos(phi_k) up.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.parameters import ArmParameters, Array

NEWTON_ROUNDS = 50
NEWTON_TOLERANCE = 1e-12
"""Height at which an elbow counts as on the table [m]."""
LARGEST_TURN = 0.3
"""Largest turn of a link in a step towards a point [rad]."""


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
    """J_c = dC/dq [m/rad], shape (..., p, n): raising joint j pitches every link from j to the elbow.   Eq. 17."""
    slope = -arm.of_links("length") * np.sin(pitches(q))
    jacobian = np.zeros((*slope.shape[:-1], len(elbows), arm.n_joints))
    for row, elbow in enumerate(elbows):
        jacobian[..., row, 1 : elbow - 1] = np.cumsum(slope[..., 1 : elbow - 1][..., ::-1], axis=-1)[..., ::-1]
    return jacobian


def on_table(arm: ArmParameters, q: ArrayLike, elbows: Sequence[int]) -> Array:
    """The pose with the elbows at z = 0 [rad], shape (n,), that changes pitches least; C(q) = 0 of eq. 18.

    Newton's method in the pitches, whose pose is also `Simulator.on_table`'s.

    Raises:
        ValueError: it finds none, since the links are too short or the pose is singular.
    """
    q = np.array(q, dtype=np.float64)
    before = np.tri(arm.n_joints)[[elbow - 2 for elbow in elbows]]
    height = elbow_heights(arm, q, elbows)
    for _ in range(NEWTON_ROUNDS):
        if np.abs(height).max(initial=0.0) < NEWTON_TOLERANCE:
            return q
        slope = -arm.of_links("length") * np.sin(pitches(q))
        turn = np.linalg.pinv(before * slope) @ height
        q = q - np.diff(turn, prepend=0.0)
        height = elbow_heights(arm, q, elbows)
    raise ValueError(f"elbows must be able to lie on the table, got heights {height} m after {NEWTON_ROUNDS} rounds")


def reaching_pose(arm: ArmParameters, q: ArrayLike, elbows: Sequence[int], position: ArrayLike) -> Array:
    """The pose with the hand at a point and the elbows at z = 0 [rad], shape (n,), that changes pitches least.

    Newton's method in the pitches, in steps of at most `LARGEST_TURN`. Joints that would be below the table are held at
    z = 0, too.

    Args:
        arm: the arm.
        q: pose to start from [rad], shape (n,).
        elbows: joint numbers held at z = 0.
        position: the hand's point [m], shape (3,).

    Raises:
        ValueError: it finds none.
    """
    start, held, length = np.array(q, dtype=np.float64), set(elbows), arm.of_links("length")
    x, y, z = np.asarray(position, dtype=np.float64)
    start[0] = np.arctan2(y, x)
    while True:
        q, missing = start, np.zeros(0)
        before = np.tri(arm.n_joints)[[joint - 2 for joint in (*sorted(held), arm.n_joints + 1)]]
        for _ in range(NEWTON_ROUNDS):
            across, along = length * np.sin(pitches(q)), length * np.cos(pitches(q))
            missing = np.append(before @ along, across.sum()) - [*[0.0] * len(held), z, np.hypot(x, y)]
            if np.abs(missing).max() < NEWTON_TOLERANCE:
                break
            turn = np.linalg.pinv(np.vstack([before * -across, along])) @ missing
            q = q - np.diff(turn * min(1.0, LARGEST_TURN / np.abs(turn).max()), prepend=0.0)
        else:
            raise ValueError(
                f"position must be within the hand's reach with joints {sorted(held)} on the table, got {position} "
                f"{np.abs(missing[-2:]).max():.3g} m away after {NEWTON_ROUNDS} rounds"
            )
        height = joint_positions(arm, q)[2:-1, 2]
        low = {int(k) + 3 for k in np.flatnonzero(height < -NEWTON_TOLERANCE)} - held
        if not low:
            return q
        held |= low


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


class HandPlacement:
    """Joint angles and rates that put the hand on targets by joints 1, n-1 and n alone.   Eq. 29.

    For whoever asks for many targets in turn; `inverse_kinematics` asks once.

    Args:
        arm: the arm.
        pose: angles [rad], shape (n,), that joints 2..n-2 keep.
    """

    def __init__(self, arm: ArmParameters, pose: ArrayLike) -> None:
        length = arm.of_links("length")
        self._pose = np.array(pose, dtype=np.float64)
        phi = pitches(self._pose)
        # Arrays without axes: NumPy takes them faster than scalars, and it is asked in every control period.
        self._inner, self._outer = np.array(length[-2]), np.array(length[-1])
        self._pose_inner, self._phi_inner = np.array(self._pose[-2]), np.array(phi[-2])
        self._base_rho = np.array((length[:-2] * np.sin(phi[:-2])).sum())
        self._base_z = np.array((length[:-2] * np.cos(phi[:-2])).sum())
        self._squares = np.square(self._inner), np.square(self._outer)
        self._product = np.array(2.0 * length[-2] * length[-1])
        self._half_turn, self._turn = np.array(np.pi), np.array(2.0 * np.pi)

    def joints(self, position: ArrayLike, velocity: ArrayLike | None = None) -> tuple[Array, Array]:
        """q_d [rad] and its exact derivative [rad/s], each (..., n), on the branch q_n > 0, with q_1 = atan2(y, x).

        Args:
            position: hand target [m], shape (..., 3).
            velocity: its rate [m/s], same shape; zero when None.

        Raises:
            ValueError: the target is out of reach, with the distance missing.
        """
        position = np.asarray(position, dtype=np.float64)
        velocity = np.zeros_like(position) if velocity is None else np.asarray(velocity, dtype=np.float64)
        inner, outer = self._inner, self._outer
        x, y, z = position[..., 0], position[..., 1], position[..., 2]
        rho = np.hypot(x, y)
        d_rho, d_z = rho - self._base_rho, z - self._base_z
        distance = np.hypot(d_rho, d_z)
        cosine = (distance**2 - self._squares[0] - self._squares[1]) / self._product
        if not np.abs(cosine).max() <= 1.0:
            missing = np.maximum(distance - (inner + outer), abs(inner - outer) - distance).max()
            if not missing <= 0.0:
                raise ValueError(
                    f"position must be within reach of the last two links, got a point {missing:.4g} m outside it"
                )
            cosine = np.clip(cosine, -1.0, 1.0)
        bend = np.arccos(cosine)
        sin_bend = np.sin(bend)
        phi_inner = np.arctan2(d_rho, d_z) - np.arctan2(outer * sin_bend, inner + outer * np.cos(bend))
        phi_outer = phi_inner + bend

        q = np.empty((*position.shape[:-1], self._pose.size))
        q[...] = self._pose
        q[..., 0] = np.arctan2(y, x)
        # Turns are taken out so that the angle stays the one nearest to the pose's.
        turned = np.mod(phi_inner - self._phi_inner + self._half_turn, self._turn)
        q[..., -2] = self._pose_inner + turned - self._half_turn
        q[..., -1] = bend

        x_dot, y_dot, z_dot = velocity[..., 0], velocity[..., 1], velocity[..., 2]
        rho_dot = (x * x_dot + y * y_dot) / rho
        # rho_dot = l1 cos(phi1) w1 + l2 cos(phi2) w2 and z_dot = -l1 sin(phi1) w1 - l2 sin(phi2) w2, solved for w.
        w_inner = (rho_dot * np.sin(phi_outer) + z_dot * np.cos(phi_outer)) / (inner * sin_bend)
        w_outer = -(rho_dot * np.sin(phi_inner) + z_dot * np.cos(phi_inner)) / (outer * sin_bend)
        q_dot = np.zeros(q.shape)
        q_dot[..., 0] = (x * y_dot - y * x_dot) / rho**2
        q_dot[..., -2] = w_inner
        q_dot[..., -1] = w_outer - w_inner
        return q, q_dot


def nearest_turn(q_d: Array, q: Array) -> Array:
    """The angles q_d [rad], (..., n), with joints 1 and n-1 whole turns on where that is nearer to q [rad], (..., n).

    The hand stays where it is. Along a path `HandPlacement` gives one of these joints another turn where it comes to
    half a turn from the pose's angle, or joint 1 to the negative x axis; a controller should go on, not back.
    """
    far = q - q_d
    if np.abs(far).max() <= np.pi:
        return q_d
    turned = q_d.copy()
    for joint in (0, -2):
        turned[..., joint] += 2.0 * np.pi * np.round(far[..., joint] / (2.0 * np.pi))
    return turned


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
    return HandPlacement(arm, pose).joints(position, velocity)

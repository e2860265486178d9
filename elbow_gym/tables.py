"""Arms as the kernel reads them: parameters in rows, and quantities of a batch."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym import kernel
from elbow_gym.parameters import ArmParameters, Array


def parameter_table(arm: ArmParameters, payload: float = 0.0) -> Array:
    """The kernel's parameter rows of one arm, shape (PARAMETER_ROWS, n)."""
    one = np.ones(arm.n_joints)
    mass, length = arm.of_links("mass"), arm.of_links("length")
    transverse, axial = arm.of_links("transverse_inertia"), arm.of_links("axial_inertia")
    motor_friction = arm.of_motors("reflected_viscous_friction")
    rows = {
        "length": length,
        "mass": mass,
        "end_inertia": transverse + mass * length**2 / 4.0,
        "inertia_difference": transverse - axial,
        "axial_inertia": axial,
        "reflected_inertia": arm.of_motors("reflected_inertia"),
        "joint_torque_constant": arm.of_motors("joint_torque_constant"),
        "friction": np.array(arm.joint_viscous_friction) + motor_friction,
        "reflected_viscous_friction": motor_friction,
        "armature_resistance": arm.of_motors("armature_resistance"),
        "inverse_inductance": 1.0 / arm.of_motors("armature_inductance"),
        "gravity": arm.gravity * one,
        "payload": payload * one,
    }
    return np.stack([rows[name] for name in kernel.PARAMETERS])


def as_batch(name: str, value: ArrayLike, shape: tuple[int, int]) -> Array:
    """A quantity as (B, n) float64, from (B, n) or one row for all. ValueError naming `name` unless finite numbers."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers of shape {shape} or {shape[1:]}, got {value!r}") from error
    if array.shape not in (shape, shape[1:]):
        raise ValueError(f"{name} must have shape {shape} or {shape[1:]}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {array[~np.isfinite(array)][0]}")
    return np.broadcast_to(array, shape)

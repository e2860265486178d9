"""Rows of an arm's parameters for the kernel, and the quantities that they come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.kernel.rows import PARAMETERS
from elbow_gym.parameters import (
    ArmParameters,
    Array,
    LinkParameters,
    MotorParameters,
    cylinder_axial_inertia,
    cylinder_transverse_inertia,
)
from elbow_gym.simulation.options import Conditions, as_conditions
from elbow_gym.table import TableParameters

# Less than any V0 I [W] that motors feed back.
NO_FLOOR = -1e300


def quantities(arm: ArmParameters) -> dict[str, Array]:
    """Every quantity that links and motors are given by, each (n,), in SI units under its field's name."""
    values = {field.name: arm.of_links(field.name) for field in fields(LinkParameters)}
    values |= {field.name: arm.of_motors(field.name) for field in fields(MotorParameters)}
    return {**values, "joint_viscous_friction": np.array(arm.joint_viscous_friction)}


def parameter_rows(
    values: Mapping[str, Array], gravity: float, conditions: Conditions, payload: ArrayLike, supply_voltage: ArrayLike
) -> Array:
    """The kernel's parameter rows, shape (..., PARAMETER_ROWS, n).

    Args:
        values: the entries of `quantities`, each (..., n).
        gravity: g [m/s^2].
        conditions: table, friction, heat and supply; payload and supply voltage are given apart.
        payload: mass at the hand [kg], shape (...).
        supply_voltage: V0 [V], shape (...).
    """
    one = np.ones_like(values["mass"])
    mass, radius, length, gear = (values[name] for name in ("mass", "radius", "length", "gear_ratio"))
    axial, transverse = cylinder_axial_inertia(mass, radius), cylinder_transverse_inertia(mass, radius, length)
    motor_friction = values["gear_viscous_friction"] * gear**2
    warming = float(conditions.heat)
    table = conditions.surface or TableParameters()
    # Without a table zero, with which a kernel that knows of one does no more than a kernel that does not.
    stiffness = 0.0 if conditions.surface is None else table.stiffness
    rows = {
        "length": length,
        "mass": mass,
        "end_inertia": transverse + mass * length**2 / 4.0,
        "inertia_difference": transverse - axial,
        "axial_inertia": axial,
        "reflected_inertia": values["rotor_inertia"] * gear**2,
        "joint_torque_constant": values["torque_constant"] * gear,
        "friction": values["joint_viscous_friction"] + motor_friction,
        "reflected_viscous_friction": motor_friction,
        "armature_resistance": values["armature_resistance"],
        "inverse_inductance": 1.0 / values["armature_inductance"],
        "gravity": gravity * one,
        "payload": np.asarray(payload)[..., None] * one,
        "stiffness": stiffness * one,
        "dissipation": table.dissipation * one,
        "table_friction": table.friction * one,
        "friction_velocity": table.friction_velocity * one,
        "elbow_friction": conditions.elbow_friction * one,
        "reflected_coulomb_friction": values["gear_coulomb_friction"] * gear,
        "heating": warming / values["heat_capacity"],
        "cooling": warming / (values["thermal_resistance"] * values["heat_capacity"]),
        "temperature_coefficient": warming * values["temperature_coefficient"],
        "sag": (conditions.supply_resistance / np.asarray(supply_voltage) ** 2)[..., None] * one,
        "bus_floor": (NO_FLOOR if conditions.regeneration else 0.0) * one,
    }
    return np.stack([rows[name] for name in PARAMETERS], axis=-2)


def parameter_table(arm: ArmParameters, conditions: Conditions | None = None) -> Array:
    """The kernel's parameter rows of one arm, shape (PARAMETER_ROWS, n)."""
    under = as_conditions(conditions)
    return parameter_rows(quantities(arm), arm.gravity, under, under.payload, under.supply_voltage)

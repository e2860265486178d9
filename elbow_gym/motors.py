"""The geared DC motors one equation a function: back-EMF, torque, gear friction, winding heat, sagging supply."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.parameters import ArmParameters, Array

COULOMB_VELOCITY = 0.05
"""Joint rate [rad/s] over which the gear's Coulomb friction comes up."""


def back_emf(arm: ArmParameters, q_dot: ArrayLike) -> Array:
    """Back-EMF at the motor terminals [V], shape (n,): K k q_dot.   Eqs 2, 7."""
    return arm.of_motors("joint_torque_constant") * np.asarray(q_dot, dtype=np.float64)


def coulomb_friction(arm: ArmParameters, q_dot: ArrayLike) -> Array:
    """Torque of the gear's Coulomb friction on the joint [N m], shape (n,), against the motion.

    -T_c k s(q_dot) with the smooth sign s(w) = w / sqrt(w^2 + w_s^2), w_s = COULOMB_VELOCITY.
    """
    q_dot = np.asarray(q_dot, dtype=np.float64)
    return -arm.of_motors("reflected_coulomb_friction") * (q_dot / np.sqrt(q_dot**2 + COULOMB_VELOCITY**2))


def motor_torque(arm: ArmParameters, q_dot: ArrayLike, q_ddot: ArrayLike, current: ArrayLike) -> Array:
    """Tau that the geared motors pass on to the links [N m], shape (n,).   Eq. 12.

    K_m i - J_m q_ddot - D_m q_dot, and the gear's Coulomb friction where it has any.
    """
    return (
        arm.of_motors("joint_torque_constant") * np.asarray(current, dtype=np.float64)
        - arm.of_motors("reflected_inertia") * np.asarray(q_ddot, dtype=np.float64)
        - arm.of_motors("reflected_viscous_friction") * np.asarray(q_dot, dtype=np.float64)
        + coulomb_friction(arm, q_dot)
    )


def armature_resistance(arm: ArmParameters, temperature_rise: ArrayLike) -> Array:
    """R (1 + alpha T) of the warm windings [ohm], shape (n,).

    Args:
        arm: the arm.
        temperature_rise: T of the windings above the ambient, at which R is given [K], shape (n,) or one for all.
    """
    warmer = 1.0 + arm.of_motors("temperature_coefficient") * np.asarray(temperature_rise, dtype=np.float64)
    return arm.of_motors("armature_resistance") * warmer


def temperature_rate(arm: ArmParameters, current: ArrayLike, temperature_rise: ArrayLike) -> Array:
    """Rate of the windings' temperature [K/s], shape (n,): C_th dT/dt = R (1 + alpha T) i^2 - T / R_th.

    Args:
        arm: the arm.
        current: armature currents i [A], shape (n,).
        temperature_rise: T above the ambient [K], shape (n,) or one for all.
    """
    copper_loss = armature_resistance(arm, temperature_rise) * np.asarray(current, dtype=np.float64) ** 2
    cooling = np.asarray(temperature_rise, dtype=np.float64) / arm.of_motors("thermal_resistance")
    return (copper_loss - cooling) / arm.of_motors("heat_capacity")


def bus_current(
    command: ArrayLike, current: ArrayLike, supply_voltage: ArrayLike, *, regeneration: bool = True
) -> Array | np.float64:
    """I that the motors' drives draw from the common supply [A], (...): sum of u i over the joints, u = command / V0.

    Negative when they feed back; without regeneration the supply then takes none, and a brake chopper burns it.

    Args:
        command: terminal voltages that a stiff supply would give [V], shape (..., n).
        current: armature currents i [A], shape (..., n).
        supply_voltage: V0 [V], shape (...).
        regeneration: whether the supply takes current back.
    """
    duty = np.asarray(command, dtype=np.float64) / np.asarray(supply_voltage)[..., None]
    drawn = (duty * np.asarray(current, dtype=np.float64)).sum(axis=-1)
    return drawn if regeneration else np.maximum(drawn, 0.0)


def terminal_voltage(
    command: ArrayLike,
    current: ArrayLike,
    supply_voltage: ArrayLike,
    supply_resistance: float,
    regeneration: bool = True,
) -> Array:
    """Voltages at the motor terminals under a supply with an internal resistance [V], shape (..., n).

    v = command (1 - R_s I / V0), I of `bus_current`: the drives keep their duty while the bus sags to V0 - R_s I. The
    supply itself loses R_s I^2 [W], so that V0 I = sum v i + R_s I^2 with regeneration.

    Args:
        command: terminal voltages that a stiff supply would give [V], shape (..., n).
        current: armature currents i [A], shape (..., n).
        supply_voltage: V0 of the unloaded supply [V], shape (...).
        supply_resistance: R_s [ohm].
        regeneration: whether the supply takes current back.
    """
    drawn = bus_current(command, current, supply_voltage, regeneration=regeneration)
    sag = supply_resistance * drawn / np.asarray(supply_voltage)
    return np.asarray(command, dtype=np.float64) * (1.0 - np.asarray(sag)[..., None])

"""Parameters of DC motors, validated when they are made, also from the figures of a data sheet."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from elbow_gym.checks import check_entries, finite, non_negative, positive

AMBIENT = 25.0
"""Temperature that data sheets count from [deg C]."""
TOLERANCE = 0.05
"""Relative difference up to which figures of one sheet, each rounded and some measured, say the same."""


@dataclass(frozen=True, kw_only=True)
class MotorParameters:
    """A DC servo motor behind a gear (eqs 1-12). All positive; frictions and temperature_coefficient also zero."""

    armature_resistance: float = 1.1
    """Armature resistance R [ohm]."""
    armature_inductance: float = 0.0017
    """Armature inductance L [H]."""
    torque_constant: float = 0.203
    """Torque constant K [N m/A], equal to the back-EMF constant [V s/rad]."""
    rotor_inertia: float = 0.000164
    """Inertia I_m of the rotor, at the motor shaft [kg m^2]."""
    gear_ratio: float = 3.0
    """Gear ratio k, turns of the motor per turn of the joint [-]."""
    gear_viscous_friction: float = 0.01
    """Viscous friction d_m of the gear, at the motor shaft [N m s/rad]."""
    gear_coulomb_friction: float = 0.0
    """Coulomb friction T_c of the gear, at the motor shaft [N m]."""
    thermal_resistance: float = 5.0
    """Thermal resistance R_th from the winding to the ambient [K/W]."""
    heat_capacity: float = 20.0
    """Heat capacity C_th of the winding [J/K]."""
    temperature_coefficient: float = 0.00393
    """Temperature coefficient alpha of the armature resistance [1/K]; copper's by default."""
    temperature_limit: float = 100.0
    """Temperature above the ambient that the winding is rated for [K]."""

    def __post_init__(self) -> None:
        may_be_zero = {"gear_viscous_friction", "gear_coulomb_friction", "temperature_coefficient"}
        for field in fields(self):
            check = non_negative if field.name in may_be_zero else positive
            object.__setattr__(self, field.name, check(field.name, getattr(self, field.name)))

    @classmethod
    def from_datasheet(
        cls,
        *,
        nominal_voltage: float,
        no_load_speed: float,
        no_load_current: float,
        terminal_resistance: float,
        terminal_inductance: float,
        rotor_inertia: float,
        torque_constant: float | None = None,
        stall_torque: float | None = None,
        thermal_resistances: tuple[float, float] | None = None,
        winding_time_constant: float | None = None,
        highest_winding_temperature: float | None = None,
        **others: float,
    ) -> MotorParameters:
        """A motor from the figures of its data sheet, in SI units.

        K is the sheet's, or what the stall torque K V/R says; the no-load speed has to agree with it,
        V = R i_0 + K w_0. What the sheet does not say keeps this class's default.

        Args:
            nominal_voltage: V that the no-load and stall figures hold at [V].
            no_load_speed: w_0 of the free shaft there [rad/s]; a sheet's rpm times pi / 30.
            no_load_current: i_0 then [A]; the torque K i_0 behind it becomes viscous friction of the gear.
            terminal_resistance: R [ohm].
            terminal_inductance: L [H].
            rotor_inertia: I_m [kg m^2]; a sheet's g cm^2 times 1e-7.
            torque_constant: K [N m/A]; this or the stall torque.
            stall_torque: torque of the held shaft at the nominal voltage [N m].
            thermal_resistances: winding to housing and housing to ambient [K/W], in series here.
            winding_time_constant: of the winding's warming against the housing [s].
            highest_winding_temperature: that the winding is rated for [deg C], above ambient air of 25.
            others: further fields, such as `gear_ratio`.

        Raises:
            ValueError: a figure is wrong or missing, or two contradict each other by more than 5 %.
        """
        volts, speed = positive("nominal_voltage", nominal_voltage), positive("no_load_speed", no_load_speed)
        idle = non_negative("no_load_current", no_load_current)
        resistance = positive("terminal_resistance", terminal_resistance)
        stall_current = volts / resistance
        if idle >= stall_current:
            raise ValueError(
                f"no_load_current must be less than the stall current {stall_current:.4g} A of nominal_voltage "
                f"{volts:g} V over terminal_resistance {resistance:g} ohm, got {idle:g}"
            )
        found = {"no_load_speed": (volts - resistance * idle) / speed}
        if torque_constant is not None:
            found["torque_constant"] = positive("torque_constant", torque_constant)
        if stall_torque is not None:
            found["stall_torque"] = positive("stall_torque", stall_torque) / stall_current
        if len(found) == 1:
            raise ValueError("torque_constant or stall_torque must be given, got neither")
        _, chosen, *_ = found
        for name, value in found.items():
            if abs(value - found[chosen]) > TOLERANCE * found[chosen]:
                raise ValueError(
                    f"{name} must agree with {chosen} to {TOLERANCE:.0%}, got torque constants of {value:.4g} and "
                    f"{found[chosen]:.4g} N m/A"
                )
        constants: dict[str, Any] = {
            "armature_resistance": resistance,
            "armature_inductance": positive("terminal_inductance", terminal_inductance),
            "torque_constant": found[chosen],
            "rotor_inertia": positive("rotor_inertia", rotor_inertia),
            # What the idling motor's torque K i_0 works against, taken as viscous.
            "gear_viscous_friction": found[chosen] * idle / speed,
        }
        if thermal_resistances is not None:
            inner, outer = (positive("thermal_resistances", value) for value in thermal_resistances)
            constants["thermal_resistance"] = inner + outer
            if winding_time_constant is not None:
                constants["heat_capacity"] = positive("winding_time_constant", winding_time_constant) / inner
        elif winding_time_constant is not None:
            raise ValueError("winding_time_constant must come with thermal_resistances, got none")
        if highest_winding_temperature is not None:
            rise = finite("highest_winding_temperature", highest_winding_temperature) - AMBIENT
            if not rise > 0.0:
                raise ValueError(
                    f"highest_winding_temperature must be above {AMBIENT:g} deg C, got {highest_winding_temperature!r}"
                )
            constants["temperature_limit"] = rise
        check_entries(others, {field.name for field in fields(cls)} - set(constants), "from_datasheet")
        return cls(**constants, **others)

    @property
    def joint_torque_constant(self) -> float:
        """Torque constant K_m = K k at the joint [N m/A].   Eqs 9-12."""
        return self.torque_constant * self.gear_ratio

    @property
    def reflected_inertia(self) -> float:
        """Inertia of the rotor J_m = I_m k^2 at the joint [kg m^2].   Eq. 12."""
        return self.rotor_inertia * self.gear_ratio**2

    @property
    def reflected_viscous_friction(self) -> float:
        """Viscous friction of the gear D_m = d_m k^2 at the joint [N m s/rad].   Eq. 12."""
        return self.gear_viscous_friction * self.gear_ratio**2

    @property
    def reflected_coulomb_friction(self) -> float:
        """Coulomb friction of the gear T_c k at the joint [N m]."""
        return self.gear_coulomb_friction * self.gear_ratio

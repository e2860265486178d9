"""Motors that can be bought, by name, from their data sheets; every preset says where its figures come from."""

from __future__ import annotations

import math
from dataclasses import dataclass

from elbow_gym.checks import check_entries, one_of
from elbow_gym.motor_parameters import MotorParameters

RPM = math.pi / 30.0
"""One turn a minute [rad/s]."""
OTHERS = ("gear_ratio", "gear_coulomb_friction", "temperature_coefficient")
"""Fields of `MotorParameters` that no sheet of a motor has."""


@dataclass(frozen=True, kw_only=True)
class DataSheet:
    """Figures of one winding of a motor as they are printed, in the units that such sheets use."""

    source: str
    """Document, edition and column; for figures at second hand also who copied them."""
    nominal_voltage: float
    """Voltage of the no-load and stall figures [V]."""
    no_load_speed: float
    """Speed of the free shaft [rpm]."""
    no_load_current: float
    """Current of the free shaft [mA]."""
    stall_torque: float
    """Torque of the held shaft [mN m]."""
    terminal_resistance: float
    """Resistance of the winding at the terminals [ohm]."""
    terminal_inductance: float
    """Inductance of the winding at the terminals [mH]."""
    torque_constant: float
    """Torque constant [mN m/A]."""
    rotor_inertia: float
    """Inertia of the rotor [g cm^2]."""
    thermal_resistances: tuple[float, float]
    """Thermal resistances from the winding to the housing and from there to the ambient [K/W]."""
    winding_time_constant: float
    """Time constant of the winding's warming [s]."""
    highest_winding_temperature: float
    """Temperature that the winding is rated for [deg C]."""

    def motor(self, **others: float) -> MotorParameters:
        """The motor in SI units; `others` are further fields. Raises ValueError as `from_datasheet` does."""
        return MotorParameters.from_datasheet(
            nominal_voltage=self.nominal_voltage,
            no_load_speed=self.no_load_speed * RPM,
            no_load_current=1e-3 * self.no_load_current,
            stall_torque=1e-3 * self.stall_torque,
            terminal_resistance=self.terminal_resistance,
            terminal_inductance=1e-3 * self.terminal_inductance,
            torque_constant=1e-3 * self.torque_constant,
            rotor_inertia=1e-7 * self.rotor_inertia,
            thermal_resistances=self.thermal_resistances,
            winding_time_constant=self.winding_time_constant,
            highest_winding_temperature=self.highest_winding_temperature,
            **others,
        )


FAULHABER_3863 = "Faulhaber, data sheet DC-Micromotors Series 3863 ... CR, edition 2012 May 10, page 1, column"
MEKA = "copied by Meka Robotics into the M3 configuration of its arm A2R2, 2010, from a maxon sheet of unknown edition"

MOTORS: dict[str, DataSheet] = {
    "faulhaber-3863h024cr": DataSheet(
        source=f"{FAULHABER_3863} 024 CR",
        nominal_voltage=24.0,
        no_load_speed=5800.0,
        no_load_current=168.0,
        stall_torque=1455.0,
        terminal_resistance=0.64,
        terminal_inductance=0.180,
        torque_constant=39.8,
        rotor_inertia=120.0,
        thermal_resistances=(2.5, 6.0),
        winding_time_constant=50.0,
        highest_winding_temperature=155.0,
    ),
    "faulhaber-3863h048cr": DataSheet(
        source=f"{FAULHABER_3863} 048 CR",
        nominal_voltage=48.0,
        no_load_speed=5800.0,
        no_load_current=84.0,
        stall_torque=1461.0,
        terminal_resistance=2.58,
        terminal_inductance=0.700,
        torque_constant=79.7,
        rotor_inertia=115.0,
        thermal_resistances=(2.5, 6.0),
        winding_time_constant=50.0,
        highest_winding_temperature=155.0,
    ),
    "maxon-re40-150w-24v": DataSheet(
        source=f"maxon RE 40, 150 W, 24 V; {MEKA}",
        nominal_voltage=24.0,
        no_load_speed=7580.0,
        no_load_current=137.0,
        stall_torque=2280.0,
        terminal_resistance=0.317,
        terminal_inductance=0.0823,
        torque_constant=30.2,
        rotor_inertia=138.0,
        thermal_resistances=(1.93, 4.65),
        winding_time_constant=41.6,
        highest_winding_temperature=155.0,
    ),
    "maxon-ec45flat-50w-24v": DataSheet(
        source=f"maxon EC 45 flat, 50 W, 24 V, order number 339286; {MEKA}",
        nominal_voltage=24.0,
        no_load_speed=4700.0,
        no_load_current=116.0,
        stall_torque=337.0,
        terminal_resistance=3.38,
        terminal_inductance=1.15,
        torque_constant=47.5,
        rotor_inertia=135.0,
        thermal_resistances=(4.5, 4.25),
        winding_time_constant=16.6,
        highest_winding_temperature=125.0,
    ),
}
"""Data sheets by the name of the preset."""


def motor(name: str, **others: float) -> MotorParameters:
    """A motor that can be bought, such as `motor("maxon-re40-150w-24v", gear_ratio=20.0)`.

    Args:
        name: one of `MOTORS`, whose `source` says where its figures come from.
        others: any of `OTHERS`, which are the gear's or the metal's.

    Raises:
        ValueError: there is no such preset, or another field is given.
    """
    one_of("motor", name, tuple(MOTORS))
    check_entries(others, set(OTHERS), name)
    return MOTORS[name].motor(**others)

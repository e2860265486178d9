"""Motors from data sheets: the figures come out of the motor's own equations again, contradictions are refused."""

import math

import numpy as np
import pytest

from elbow_gym import MotorParameters

# A 24 V motor of the 100 W class whose sheet agrees with itself, rounded as sheets are: rpm, mH, g cm^2.
SHEET = {
    "nominal_voltage": 24.0,
    "no_load_speed": 7580.0 * math.pi / 30.0,
    "no_load_current": 0.137,
    "terminal_resistance": 0.299,
    "terminal_inductance": 0.082e-3,
    "rotor_inertia": 142e-7,
}
THERMAL = {
    "thermal_resistances": (1.9, 4.7),
    "winding_time_constant": 41.6,
    "highest_winding_temperature": 155.0,
}


@pytest.mark.parametrize("figure", [{"torque_constant": 0.0302}, {"stall_torque": 2.42}])
def test_the_motor_idles_and_stalls_as_its_sheet_says(figure):
    motor = MotorParameters.from_datasheet(**SHEET, **figure)
    # V = R i + K w and K i = d w at no load, K V / R at stall.
    conductance = motor.gear_viscous_friction / motor.torque_constant
    speed = 24.0 / (motor.torque_constant + motor.armature_resistance * conductance)
    assert speed == pytest.approx(SHEET["no_load_speed"], rel=0.01)
    assert conductance * speed == pytest.approx(0.137, rel=0.01)
    assert motor.torque_constant * 24.0 / motor.armature_resistance == pytest.approx(2.42, rel=0.005)
    assert (motor.armature_inductance, motor.rotor_inertia) == (0.082e-3, 142e-7)


def test_the_winding_warms_against_its_housing_as_the_sheet_says():
    motor = MotorParameters.from_datasheet(**SHEET, torque_constant=0.0302, **THERMAL, gear_ratio=66.0)
    assert motor.heat_capacity * 1.9 == pytest.approx(41.6)
    assert motor.thermal_resistance == pytest.approx(6.6)
    assert motor.temperature_limit == 130.0
    assert motor.gear_ratio == 66.0
    assert (
        MotorParameters.from_datasheet(**SHEET, torque_constant=0.0302).heat_capacity == MotorParameters().heat_capacity
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, "torque_constant or stall_torque must be given, got neither"),
        (
            {"torque_constant": 0.203},
            r"no_load_speed must agree with torque_constant to 5%, got .* 0\.03018 and 0\.203",
        ),
        ({"torque_constant": 0.0302, "stall_torque": 1.0}, r"stall_torque must agree .* 0\.01246 and 0\.0302 N m/A"),
        ({"torque_constant": 0.0302, "no_load_current": 81.0}, r"no_load_current must be less than .* 80\.27 A"),
        ({"torque_constant": 0.0302, "terminal_resistance": 0.0}, "terminal_resistance must be positive, got 0"),
        ({"torque_constant": 0.0302, "winding_time_constant": 40.0}, "must come with thermal_resistances, got none"),
        ({"torque_constant": 0.0302, "highest_winding_temperature": 20.0}, "must be above 25 deg C, got 20"),
        ({"torque_constant": 0.0302, "gear": 66.0}, "from_datasheet must have only the entries .*, got 'gear'"),
        ({"torque_constant": np.nan}, "torque_constant must be finite"),
    ],
)
def test_missing_and_contradicting_figures_are_refused_with_their_numbers(changes, message):
    with pytest.raises(ValueError, match=message):
        MotorParameters.from_datasheet(**{**SHEET, **changes})

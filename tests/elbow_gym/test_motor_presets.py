"""Motors that can be bought: their sheets agree with themselves, and come out of the motor's own equations again."""

import math

import pytest

from elbow_gym import ArmParameters, motor, paper_arm
from elbow_gym.motor_presets import MOTORS
from elbow_gym.parameters import as_arm


@pytest.mark.parametrize("name", MOTORS)
def test_a_preset_idles_and_stalls_as_its_sheet_says(name):
    sheet, found = MOTORS[name], motor(name)
    # V = R i + K w and K i = d w at no load, K V / R at stall.
    conductance = found.gear_viscous_friction / found.torque_constant
    speed = sheet.nominal_voltage / (found.torque_constant + found.armature_resistance * conductance)
    assert speed == pytest.approx(sheet.no_load_speed * math.pi / 30.0, rel=0.025)
    assert 1e3 * conductance * speed == pytest.approx(sheet.no_load_current, rel=0.025)
    stall = 1e3 * found.torque_constant * sheet.nominal_voltage / found.armature_resistance
    assert stall == pytest.approx(sheet.stall_torque, rel=0.03)


@pytest.mark.parametrize("name", MOTORS)
def test_a_preset_says_where_its_figures_come_from(name):
    source = MOTORS[name].source
    assert "sheet" in source
    assert "edition" in source
    assert any(maker in source for maker in ("Faulhaber", "maxon"))


def test_figures_are_in_si_units():
    found = motor("faulhaber-3863h024cr", gear_ratio=20.0)
    assert found.torque_constant == pytest.approx(0.0398)  # 39.8 mN m/A
    assert found.armature_inductance == pytest.approx(180e-6)  # 180 uH
    assert found.rotor_inertia == pytest.approx(1.2e-5)  # 120 g cm^2
    assert (found.thermal_resistance, found.temperature_limit) == (8.5, 130.0)
    assert found.heat_capacity == pytest.approx(20.0)
    assert found.gear_ratio == 20.0


def test_motors_of_an_arms_dict_may_be_presets():
    plain = paper_arm().to_dict()
    plain["motors"][0] = "maxon-re40-150w-24v"
    plain["motors"][1] = {"preset": "maxon-ec45flat-50w-24v", "gear_ratio": 66.0}
    arm = ArmParameters.from_dict(plain)
    assert arm.motors[0] == motor("maxon-re40-150w-24v")
    assert arm.motors[1] == motor("maxon-ec45flat-50w-24v", gear_ratio=66.0)
    assert arm.motors[2] == paper_arm().motors[2]
    assert as_arm(arm.to_dict()) == arm


@pytest.mark.parametrize(
    ("plain", "message"),
    [
        ("maxon-re41", r"motor must be one of \('faulhaber-3863h024cr', .*, got 'maxon-re41'"),
        ({"preset": "maxon-re40-150w-24v", "torque_constant": 0.1}, "only the entries .*, got 'torque_constant'"),
        ({"preset": "maxon-re40-150w-24v", "ratio": 3.0}, "must have only the entries .*, got 'ratio'"),
    ],
)
def test_an_unknown_preset_or_a_figure_of_the_sheet_is_refused(plain, message):
    arm = paper_arm().to_dict()
    arm["motors"][0] = plain
    with pytest.raises(ValueError, match=message):
        ArmParameters.from_dict(arm)

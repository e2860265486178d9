"""Bad input is refused in words; derived quantities are the paper's; arms survive JSON."""

import json
import math
from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest
from hypothesis import given

from elbow_gym import ArmParameters, LinkParameters, MotorParameters, paper_arm
from elbow_gym.parameters import as_arm, as_elbows
from tests.support.strategies import arms

MAY_BE_ZERO = ["gear_viscous_friction", "gear_coulomb_friction", "temperature_coefficient"]


@pytest.mark.parametrize("name", [f.name for f in fields(MotorParameters) if f.name not in MAY_BE_ZERO])
@pytest.mark.parametrize("value", [0.0, -3.0])
def test_motor_constants_must_be_positive(name, value):
    with pytest.raises(ValueError, match=f"^{name} must be positive, got {value}$"):
        MotorParameters(**{name: value})


@pytest.mark.parametrize("name", MAY_BE_ZERO)
def test_frictions_and_the_temperature_coefficient_may_be_zero_but_not_negative(name):
    assert getattr(MotorParameters(**{name: 0.0}), name) == 0.0
    with pytest.raises(ValueError, match=rf"^{name} must not be negative, got -0\.1$"):
        MotorParameters(**{name: -0.1})


@pytest.mark.parametrize(
    ("value", "rule"), [(math.nan, "finite"), (math.inf, "finite"), ("1", "number"), (True, "number")]
)
def test_constants_must_be_finite_numbers(value, rule):
    with pytest.raises(ValueError, match=f"^gear_ratio must be .*{rule}, got {value!r}$"):
        MotorParameters(gear_ratio=value)


@pytest.mark.parametrize(
    ("name", "value", "rule"),
    [
        ("mass", 0.0, "positive"),
        ("radius", -0.01, "positive"),
        ("length", -0.3, "not be negative"),
        ("mass", math.nan, "finite"),
    ],
)
def test_link_constants_are_checked(name, value, rule):
    with pytest.raises(ValueError, match=f"^{name} must .*{rule}, got {value}$"):
        LinkParameters(**{name: value})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"links": ()}, r"^links must have 3 to 64 entries, got 0$"),
        ({"links": (LinkParameters(length=0.0),) * 2}, r"^links must have 3 to 64 entries, got 2$"),
        ({"motors": (MotorParameters(),) * 9}, r"^motors must have one entry per link \(10\), got 9$"),
        ({"nominal_pose": (0.0,) * 11}, r"^nominal_pose must have one entry per link \(10\), got 11$"),
        ({"nominal_pose": (0.0,) * 9 + (math.nan,)}, r"^nominal_pose\[10\] must be finite, got nan$"),
        (
            {"joint_viscous_friction": (0.5,) * 9 + (-1.0,)},
            r"^joint_viscous_friction\[10\] must not be negative, got -1\.0$",
        ),
        ({"links": (LinkParameters(),) * 10}, r"^length of link 1 must be zero .*, got 0\.3$"),
        ({"links": (LinkParameters(length=0.0),) * 10}, r"^length of link 2 must be positive, got 0\.0$"),
        ({"motors": ("servo",) * 10}, r"^motors\[1\] must be MotorParameters, got 'servo'$"),
        ({"gravity": math.inf}, r"^gravity must be finite, got inf$"),
    ],
)
def test_arm_names_what_is_wrong(arm, change, message):
    with pytest.raises(ValueError, match=message):
        replace(arm, **change)


@pytest.mark.parametrize(
    ("elbows", "message"),
    [
        (11, r"elbows must be 0, 1, 2 or a tuple of joint numbers, got 11"),
        (-1, r"elbows must be 0, 1, 2 .*, got -1"),
        (True, r"elbows must be 0, 1, 2 .*, got True"),
        (1.0, r"elbows must be 0, 1, 2 .*, got 1\.0"),
        ((1,), r"elbows must be joints 3 to 10 .*, got 1 in \(1,\)"),
        ((2, 4), r"elbows must be joints 3 to 10 .*, got 2 in \(2, 4\)"),
        ((4, 11), r"elbows must be joints 3 to 10 .*, got 11 in \(4, 11\)"),
        ((4, 4), r"elbows must not repeat a joint, got \(4, 4\)"),
        ((4.0,), r"elbows must be joint numbers \(integers\), got \(4\.0,\)"),
    ],
)
def test_elbows_that_cannot_be_are_refused(elbows, message):
    with pytest.raises(ValueError, match=message):
        as_elbows(elbows, 10)


def test_elbows_as_a_count_are_the_papers_joints_and_as_joints_are_sorted():
    assert [as_elbows(count, 10) for count in (0, 1, 2)] == [(), (4,), (4, 7)]
    assert as_elbows([7, 3], 10) == as_elbows(np.array([3, 7]), 10) == (3, 7)
    with pytest.raises(ValueError, match="elbows must be joints 3 to 5"):
        as_elbows(2, 5)


def test_motor_quantities_at_the_joint_are_the_papers():
    motor = MotorParameters()
    assert motor.joint_torque_constant == pytest.approx(0.609, rel=1e-15)
    assert motor.reflected_inertia == pytest.approx(0.001476, rel=1e-15)
    assert motor.reflected_viscous_friction == pytest.approx(0.09, rel=1e-15)


def test_the_gear_multiplies_coulomb_friction_once():
    assert MotorParameters().reflected_coulomb_friction == 0.0
    assert MotorParameters(gear_coulomb_friction=0.02).reflected_coulomb_friction == pytest.approx(0.06, rel=1e-15)


def test_link_inertia_is_a_solid_cylinders():
    link = LinkParameters(mass=0.1, length=0.3, radius=0.01)
    assert link.axial_inertia == pytest.approx(5e-6, rel=1e-15)
    assert link.transverse_inertia == pytest.approx(7.525e-4, rel=1e-15)


@given(arms())
def test_arm_survives_json(arm):
    assert ArmParameters.from_dict(json.loads(json.dumps(arm.to_dict()))) == arm


def test_an_arm_written_before_gears_rubbed_and_windings_warmed_still_loads(arm):
    plain = arm.to_dict()
    beyond = set(vars(MotorParameters())) - {
        "armature_resistance", "armature_inductance", "torque_constant", "rotor_inertia", "gear_ratio",
        "gear_viscous_friction",
    }  # fmt: skip
    assert len(beyond) == 5
    plain["motors"] = [{key: motor[key] for key in motor if key not in beyond} for motor in plain["motors"]]
    assert ArmParameters.from_dict(plain) == arm


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"colour": "red"}, r"^arm must have only the entries .*, got 'colour'$"),
        ({"links": [{"mass": 0.1, "weight": 1.0}] * 10}, r"^links must have only the entries .*, got 'weight'$"),
        ({"motors": [{"R": 1.1}] * 10}, r"^motors must have only the entries .*, got 'R'$"),
        ({"links": "ten"}, r"^links must be a list, got 'ten'$"),
        ({"links": [3] * 10}, r"^links must hold dicts of LinkParameters, got 3$"),
    ],
)
def test_a_dict_that_is_no_arm_is_refused(arm, change, message):
    with pytest.raises(ValueError, match=message):
        ArmParameters.from_dict(arm.to_dict() | change)


def test_a_missing_entry_is_named(arm):
    plain = arm.to_dict()
    del plain["motors"]
    with pytest.raises(ValueError, match=r"^arm must have the entry 'motors'"):
        ArmParameters.from_dict(plain)


def test_an_arm_is_a_preset_a_dict_or_itself(arm):
    assert as_arm("paper") == as_arm(arm.to_dict()) == as_arm(arm) == paper_arm()
    with pytest.raises(ValueError, match=r"^arm must be one of \['paper'\] or a .json file, got 'puma'$"):
        as_arm("puma")
    with pytest.raises(ValueError, match=r"^arm must be a preset name, a dict or ArmParameters, got 7$"):
        as_arm(7)


def test_parameters_cannot_be_changed(arm):
    with pytest.raises(FrozenInstanceError):
        arm.gravity = 0.0

"""An environment's arguments: what is refused, and how a control period is divided into RK4 steps."""

import dataclasses
import json
import math
import re

import numpy as np
import pytest

from elbow_gym import Circle, paper_arm
from elbow_gym.task.episodes import Episodes
from elbow_gym.task.settings import Settings

POSITIVE = ("control_frequency", "timestep", "duration", "voltage_limit")
NON_NEGATIVE = ("start_noise", "tracking_weight", "energy_weight")


@pytest.mark.parametrize("name", POSITIVE)
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_rates_times_and_the_voltage_must_be_positive(name, value):
    with pytest.raises(ValueError, match=f"^{name} must be positive, got {value}$"):
        Settings(**{name: value})


@pytest.mark.parametrize("name", NON_NEGATIVE)
def test_noise_and_weights_may_be_zero_but_not_negative(name):
    assert getattr(Settings(**{name: 0.0}), name) == 0.0
    with pytest.raises(ValueError, match=f"^{name} must not be negative, got -0.5$"):
        Settings(**{name: -0.5})


@pytest.mark.parametrize("name", POSITIVE + NON_NEGATIVE)
@pytest.mark.parametrize(
    ("value", "rule"),
    [
        (math.nan, "must be finite, got nan"),
        (math.inf, "must be finite, got inf"),
        (True, "must be a number, got True"),
        (None, "must be a number, got None"),
        ("1.0", "must be a number, got '1.0'"),
    ],
)
def test_numbers_must_be_finite_numbers(name, value, rule):
    if (name, value) == ("timestep", None):
        pytest.skip("None is the timestep's default")
    with pytest.raises(ValueError, match=f"^{name} {rule}$"):
        Settings(**{name: value})


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ({"elbows": 3}, "elbows must be 0, 1, 2 or a tuple of joint numbers, got 3"),
        ({"elbows": True}, "elbows must be 0, 1, 2 or a tuple of joint numbers, got True"),
        ({"elbows": (2,)}, "elbows must be joints 3 to 10 (joints 1 and 2 sit on the base), got 2 in (2,)"),
        ({"elbows": (4, 11)}, "elbows must be joints 3 to 10 (joints 1 and 2 sit on the base), got 11 in (4, 11)"),
        ({"elbows": (4, 4)}, "elbows must not repeat a joint, got (4, 4)"),
        ({"elbows": (4.0,)}, "elbows must be joint numbers (integers), got (4.0,)"),
        ({"arm": "human"}, "arm must be one of ['paper'] or a .json file, got 'human'"),
        ({"arm": 10}, "arm must be a preset name, a dict or ArmParameters, got 10"),
        ({"action_unit": "ampere"}, "action_unit must be one of ('fraction', 'volt'), got 'ampere'"),
        ({"start": "random"}, "start must be one of ('paper', 'on_target'), got 'random'"),
        ({"regeneration": 1}, "regeneration must be True or False, got 1"),
        ({"duration": 0.005}, "duration must be at least one control period (0.02 s), got 0.005"),
        ({"circle": {"radius": -1.0}}, "circle radius must be positive, got -1.0"),
        (
            {"circle": {"center": (5.0, 0.0, 0.0)}},
            "circle must lie within the hand's reach, got the point (5.1, 0.0, 0.0) 2.4 m outside",
        ),
    ],
)
def test_wrong_value_is_an_error_naming_argument_rule_and_value(argument, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        Settings(**argument)


def test_episode_too_long_to_count_is_refused_by_name():
    with pytest.raises(ValueError, match=r"^duration must .*, got 1e"):
        Settings(duration=1e308)


def test_missing_and_unknown_arm_entries_are_named():
    plain = paper_arm().to_dict()
    with pytest.raises(ValueError, match=r"^arm must have only the entries .*, got 'colour'$"):
        Settings(arm={**plain, "colour": "red"})
    del plain["motors"]
    with pytest.raises(ValueError, match=r"^arm must have the entry 'motors', got "):
        Settings(arm=plain)


def test_unknown_keyword_is_a_type_error():
    with pytest.raises(TypeError, match="unexpected keyword argument 'elbow'"):
        Settings(elbow=2)


def test_settings_cannot_be_changed():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Settings().duration = 1.0


@pytest.mark.parametrize(
    ("control_frequency", "timestep", "n_substeps"),
    [
        (50.0, 0.002, 10),
        (10_000.0, 0.002, 1),
        (500.0, 0.002, 1),
        (100.0, 0.003, 4),
        (30.0, 0.002, 17),
        (1000.0 / 3.0, 0.0003, 10),
        (0.5, 0.001, 2000),
    ],
)
def test_control_period_is_divided_into_the_fewest_steps_of_at_most_the_timestep(
    control_frequency, timestep, n_substeps
):
    steps = Settings(control_frequency=control_frequency, timestep=timestep).substeps
    assert len(steps) == n_substeps
    assert np.ptp(steps) == 0.0
    assert steps.sum() * control_frequency == pytest.approx(1.0, rel=1e-12)
    assert steps.max() <= timestep * (1.0 + 1e-9)


def test_ten_kilohertz_control_makes_one_step_of_a_tenth_of_a_millisecond():
    assert Settings(control_frequency=10_000.0).substeps == pytest.approx([1e-4], rel=1e-15)


def test_default_steps_grow_after_the_voltages_jump_to_the_longest_that_the_fastest_rate_allows():
    settings = Settings()
    assert settings.timestep is None
    # 0.6, 1.2, 1.8 and 2.2 over (D + D_m) / J = 400 1/s.
    # Five seconds warm a winding by 106 K at most, 1.42 times its resistance; in the end it would be 3.7 times.
    warm = [Settings(integrator="rk4", heat=True, duration=duration).substeps.size for duration in (5.0, 5e3)]
    assert [Settings(integrator="rk4").substeps.size, *warm] == [13, 18, 47]
    assert Episodes(Settings(integrator="rk4", heat=True)).simulator.timestep == pytest.approx(0.02 / 18)
    assert settings.substeps == pytest.approx([0.0015, 0.003, 0.0045, 0.0055, 0.0055], rel=1e-3)
    assert settings.substeps.sum() == pytest.approx(0.02, rel=1e-15)
    sagging = Settings(supply_resistance=0.3)
    assert sagging.substeps.max() < 0.25 * settings.substeps.max()
    drawn = Settings(randomize={"joint_viscous_friction": [0.5, 2.0]})
    assert drawn.substeps.max() < 0.6 * settings.substeps.max()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"timestep": 0.1}, r"timestep must be at most 0\.0055 s, for the rate 'friction' of 399\.7 1/s .*, got 0\.1$"),
        ({"timestep": 1e-12}, r"timestep must be at least 1e-05 s, for at most 2000 substeps .*, got 1e-12$"),
        (
            {"table": True, "timestep": 0.002},
            r"timestep must be at most 0\.000784 s, for the rate 'table' .*",
        ),
        (
            {"table": {"stiffness": 1e12}},
            r"a control period must take at most 2000 substeps, .* the rate 'table' ",
        ),
        ({"integrator": "euler"}, r"integrator must be one of \('exponential', 'rk4'\), got 'euler'$"),
    ],
)
def test_steps_that_are_too_long_or_too_many_are_refused_by_name(more, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        Settings(**more)


@pytest.mark.parametrize("control_frequency", [1.0, 7.0, 30.0, 50.0, 333.0, 1000.0])
@pytest.mark.parametrize("duration", [1.0, 5.0, 12.0])
def test_horizon_lasts_the_duration_whatever_the_control_frequency(control_frequency, duration):
    settings = Settings(control_frequency=control_frequency, duration=duration)
    assert settings.horizon * settings.control_period == pytest.approx(duration, rel=1e-12)


def test_parsed_forms_are_the_papers_by_default_and_json_or_objects_mean_the_same():
    settings = Settings()
    assert (settings.parsed_arm, settings.parsed_circle, settings.elbow_joints) == (paper_arm(), Circle(), (4, 7))
    assert Settings(elbows=[7, 4]).elbow_joints == (4, 7)
    plain = json.loads(json.dumps({"arm": paper_arm().to_dict(), "circle": Circle(radius=0.2).to_dict()}))
    given = Settings(**plain)
    assert given.parsed_arm == Settings(arm=paper_arm()).parsed_arm == paper_arm()
    assert given.parsed_circle == Settings(circle=Circle(radius=0.2)).parsed_circle == Circle(radius=0.2)

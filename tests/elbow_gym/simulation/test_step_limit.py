"""Steps that are chosen from an arm's rates, and those that are refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from elbow_gym import MotorParameters, paper_arm
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_table
from elbow_gym.simulation.rates import rates
from elbow_gym.simulation.step_limit import (
    CLASSICAL,
    INTEGRATORS,
    MOST_SUBSTEPS,
    check_option,
    check_timestep,
    limits,
    schedule,
)

STIFF = {"stiffness": 1e5}


def rates_of(arm, **conditions):
    under = Conditions(**conditions)
    return rates(parameter_table(arm, under), under)


def test_limits_name_the_rate_that_asks_for_the_shortest_step():
    paper = rates_of(paper_arm())
    assert limits(paper, "exponential") == (pytest.approx(2.2 / (0.59 / (0.000164 * 9.0))), "friction")
    assert limits(paper, "rk4") == (pytest.approx(1.4 * 0.0017 / 1.1), "armature")
    table = rates_of(paper_arm(), table=STIFF)
    assert limits(table, "exponential") == (pytest.approx(0.7 / 2000.0, rel=0.01), "table")
    sagging = rates_of(paper_arm(), supply_resistance=0.3)
    assert limits(sagging, "exponential") == (pytest.approx(2.2 * 0.0017 / 3.0), "supply")
    assert limits(sagging, "rk4") == (pytest.approx(1.4 * 0.0017 / 4.1), "armature")


def test_substeps_of_the_papers_arm_grow_after_the_voltages_jump():
    paper = rates_of(paper_arm())
    unit = 0.000164 * 9.0 / 0.59
    wanted = np.array([0.6, 1.2, 1.8, 2.2, 2.2])
    np.testing.assert_allclose(schedule(0.02, paper, "exponential"), wanted * 0.02 / wanted.sum(), rtol=1e-12)
    assert wanted.sum() * unit == pytest.approx(0.02, rel=1e-3)
    np.testing.assert_allclose(schedule(0.02, paper, "rk4"), np.full(13, 0.02 / 13.0))
    np.testing.assert_array_equal(schedule(0.0005, paper, "exponential"), [0.0005])


@given(period=st.floats(1e-4, 0.05), stiffness=st.floats(1e2, 1e7), integrator=st.sampled_from(INTEGRATORS))
def test_substeps_add_up_to_the_period_grow_and_exceed_no_limit(period, stiffness, integrator):
    found = rates_of(paper_arm(), table={"stiffness": stiffness})
    longest, _ = limits(found, integrator)
    substeps = schedule(period, found, integrator)
    assert math.fsum(substeps) == pytest.approx(period, rel=1e-14)
    assert (np.diff(substeps) >= 0.0).all()
    assert 0.0 < substeps.min() <= substeps.max() <= longest * (1.0 + 1e-9)
    assert np.unique(substeps).size <= (4 if integrator == "exponential" else 1)
    # Not more than it takes: one step fewer would be too long.
    assert (substeps.size - 4) * longest * (1.0 if integrator == "exponential" else CLASSICAL) < period


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_an_arm_that_would_take_thousands_of_substeps_is_refused_by_name(integrator):
    found = rates_of(paper_arm(), table={"stiffness": 1e10})
    with pytest.raises(
        ValueError,
        match=r"^a control period must take at most 2000 substeps, got 0\.02 s in steps of at most 1\.11e-06 s, "
        r"for the rate 'table' of .* 1/s \(sqrt\(stiffness / mass\)\)$",
    ):
        schedule(0.02, found, integrator)


def test_constants_beyond_float64_are_refused_by_name():
    found = rates_of(replace(paper_arm(), motors=(MotorParameters(rotor_inertia=1e-300, torque_constant=1e200),) * 10))
    assert limits(found, "rk4") == (0.0, "coupling")
    with pytest.raises(ValueError, match="for the rate 'coupling' of inf 1/s"):
        schedule(0.02, found, "rk4")


def test_a_timestep_that_is_too_long_or_too_short_is_refused():
    paper = rates_of(paper_arm())
    check_timestep(0.0055, 0.02, paper, "exponential")
    check_timestep(0.002, 0.02, paper, "rk4")
    check_timestep(1.0, 0.001, paper, "rk4")
    check_timestep(0.02 / MOST_SUBSTEPS, 0.02, paper, "rk4")
    with pytest.raises(
        ValueError,
        match=r"^timestep must be at most 0\.0055 s, for the rate 'friction' of 399\.7 1/s "
        r"\(viscous and Coulomb friction of joint and gear / rotor_inertia\), got 0\.01$",
    ):
        check_timestep(0.01, 0.02, paper, "exponential")
    with pytest.raises(
        ValueError, match=r"^timestep must be at most 0\.00216 s, for the rate 'armature' of 647\.1 1/s"
    ):
        check_timestep(0.0025, 0.02, paper, "rk4")
    with pytest.raises(
        ValueError,
        match=r"^timestep must be at least 1e-05 s, for at most 2000 substeps in a control period of 0\.02 s, "
        r"got 1e-12$",
    ):
        check_timestep(1e-12, 0.02, paper, "rk4")


def test_an_arms_own_parameters_that_the_steps_do_not_resolve_are_refused_by_name():
    step = float(schedule(0.02, rates_of(paper_arm()), "exponential").max())
    check_option("parameters", step, rates_of(paper_arm()), "exponential")
    stiff = replace(paper_arm(), joint_viscous_friction=(0.5,) * 9 + (5.0,))
    with pytest.raises(
        ValueError,
        match=r"^options\['parameters'\] must allow substeps of 0\.0055 s, got 0\.000638 s at most, for the rate "
        r"'friction' of 3449 1/s",
    ):
        check_option("parameters", step, rates_of(stiff), "exponential")


def test_a_slow_arms_control_period_takes_the_more_substeps_the_less_of_its_fastest_time_it_is():
    slow = {**dict.fromkeys(rates_of(paper_arm()), 0.0), "friction": 20.0}
    assert schedule(0.02, slow, "exponential") == pytest.approx([0.02 / 3.0, 0.04 / 3.0])
    assert schedule(0.02, {**slow, "friction": 46.0}, "exponential") == pytest.approx([0.02 / 6, 0.04 / 6, 0.06 / 6])
    assert schedule(0.02, slow, "rk4") == pytest.approx([0.02])
    assert schedule(0.02, {**slow, "friction": 14.0}, "exponential") == pytest.approx([0.02])

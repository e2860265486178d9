"""With every switch on or off, the recursion equals the reference equations, and a switch does no more than it says."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from elbow_gym import dynamics, motors, paper_arm
from elbow_gym.kernel.build import kernel
from elbow_gym.kernel.rows import (
    LARGEST_AMPLIFICATION,
    STATE_ROWS,
    SUMMARY_COLUMNS,
    SWITCHED_STATE,
    SWITCHED_STATE_ROWS,
)
from elbow_gym.kernel.slots import BLOCK_LANES
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_table
from elbow_gym.table import TableParameters
from tests.support.comparisons import assert_close, assume_solvable
from tests.support.kernel_calls import EVERYTHING, accelerations, uncompiled
from tests.support.strategies import between, cases

SETS = [dict(zip(EVERYTHING, on, strict=True)) for on in product((False, True), repeat=3)]
"""Every combination of switches; a kernel is compiled for each that is asked for."""


def named(on):
    return "+".join(name for name in on if on[name]) or "none"


@st.composite
def rough_cases(draw):
    """A case whose gears have Coulomb friction and whose windings differ."""
    case = draw(cases(largest=8))
    rough = tuple(
        replace(
            motor,
            gear_coulomb_friction=draw(between(0.0, 0.05)),
            thermal_resistance=draw(between(0.5, 10.0)),
            heat_capacity=draw(between(1.0, 50.0)),
        )
        for motor in case.arm.motors
    )
    return case._replace(arm=replace(case.arm, motors=rough))


@st.composite
def conditions(draw, table, rubbing, drive):
    """Whatever the switches leave open."""
    surface = TableParameters(
        stiffness=draw(between(1e2, 1e5)),
        dissipation=draw(between(0.0, 2.0)),
        friction=draw(between(0.0, 1.0)),
        friction_velocity=draw(between(0.001, 0.1)),
    )
    return Conditions(
        table=surface if table else None,
        elbow_friction=draw(between(0.0, 0.5)) if rubbing else 0.0,
        heat=drive,
        supply_resistance=draw(between(0.0, 0.5)) if drive else 0.0,
        regeneration=draw(st.booleans()),
    )


def expected(case, under, rise):
    """The reference's accelerations at the voltage that the supply leaves."""
    arm, q, q_dot, current, command, elbows = case
    supply = under.supply_voltage, under.supply_resistance, under.regeneration
    voltage = motors.terminal_voltage(command, current, *supply)
    extra = {"table": under.surface, "elbow_friction": under.elbow_friction, "temperature_rise": rise}
    return dynamics.forward_dynamics(arm, q, q_dot, current, voltage, elbows, **extra)


@pytest.mark.parametrize(
    ("make", "on"),
    [
        (kernel, EVERYTHING),
        *((uncompiled, {**dict.fromkeys(EVERYTHING, False), name: True}) for name in EVERYTHING),
    ],
    ids=["compiled, everything", *EVERYTHING],
)
@given(data=st.data())
@settings(max_examples=60)
def test_fast_form_equals_the_reference_with_every_switch(make, on, data):
    case = data.draw(rough_cases() if on["drive"] else cases(largest=8))
    under = data.draw(conditions(**on))
    assume_solvable(dynamics.mass_matrix(case.arm, case.q), dynamics.constraint_jacobian(case.arm, case.q, case.elbows))
    rise = np.full(case.arm.n_joints, data.draw(between(0.0, 80.0)) if under.heat else 0.0)
    state = np.zeros((1, SWITCHED_STATE_ROWS, case.arm.n_joints))
    state[0, :3] = case.q, case.q_dot, case.current
    state[0, SWITCHED_STATE.index("temperature_rise") + STATE_ROWS] = rise
    parameters = parameter_table(case.arm, under)[None]
    wanted = expected(case, under, rise)
    if under.elbow_friction:
        # Where friction jams an arm, the kernel bounds what it adds and the reference does not.
        smooth = expected(case, replace(under, elbow_friction=0.0), rise).elbow_force
        largest = LARGEST_AMPLIFICATION * np.abs(smooth).max(initial=0.0)
        assume(wanted.elbow_force.max(initial=0.0) <= largest)
    found = accelerations(1, state, parameters, case.voltage[None], case.elbows, make, **on)
    for value, reference, tolerance in zip(found, wanted, (1e-9, 1e-9, 1e-12), strict=True):
        assert_close(value[0], reference, tolerance)


def advanced(entries, rows, on):
    """State and summary of three arms after ten steps of 0.5 ms, under what is on and nothing of what is off."""
    rng = np.random.default_rng(5)
    under = Conditions(
        table={"friction": 0.3, "stiffness": 1e4} if on["table"] else None,
        elbow_friction=0.2 if on["rubbing"] else 0.0,
        heat=on["drive"],
        supply_resistance=0.1 if on["drive"] else 0.0,
        regeneration=not on["drive"],
    )
    rough = tuple(replace(motor, gear_coulomb_friction=0.01 * on["drive"]) for motor in paper_arm().motors)
    parameters = parameter_table(replace(paper_arm(), motors=rough), under)
    state, elbows = np.zeros((3, rows, 10)), np.array([4, 7])
    state[:, 0] = paper_arm().nominal_pose + 0.02 * rng.normal(size=(3, 10))
    state[:, 1:3] = rng.normal(size=(3, 2, 10))
    if on["table"]:
        # The last arm's links beyond its elbows press on the table from the start to the end.
        state[2, 0, 6:] = np.pi / 2.0 + 0.02 - state[2, 0, 1:6].sum(), 0.0, 0.0, 0.0
        state[2, 1] = 0.0
    parameters = parameters * rng.uniform(0.8, 1.25, (3, *parameters.shape))
    summary, voltage = np.zeros((3, SUMMARY_COLUMNS + 2)), rng.uniform(-20.0, 20.0, (3, 10))
    entries.advance(state, parameters, voltage, elbows, np.full(10, 5e-4), summary, 0, 3)
    return state, summary


def uncompiled_run(on, exponential=True):
    entries = uncompiled(1, exponential=exponential, **on)
    return advanced(entries, SWITCHED_STATE_ROWS if any(on.values()) else STATE_ROWS, on)


@pytest.mark.parametrize("on", SETS, ids=named)
def test_a_switch_that_has_nothing_to_do_changes_no_bit(on):
    state, summary = advanced(kernel(1, **EVERYTHING), SWITCHED_STATE_ROWS, on)
    expected_state, expected_summary = uncompiled_run(on)
    rows = expected_state.shape[1]
    np.testing.assert_array_equal(state[:, :rows], expected_state)
    np.testing.assert_array_equal(summary, expected_summary)
    assert not state[:, rows:].any()
    losses = dict(zip(SWITCHED_STATE, state[:, STATE_ROWS:].any(axis=(0, 2)), strict=True))
    assert losses["contact_normal"] == on["table"]
    assert losses["contact_loss"] == (on["table"] or on["rubbing"])
    assert losses["temperature_rise"] == losses["supply_loss"] == on["drive"]


EXPONENTIAL = [pytest.param(on, True, id=named(on)) for on in SETS]
CLASSICAL = [pytest.param(on, False, id=f"{named(on)}, classical") for on in (SETS[0], SETS[-1])]


@pytest.mark.soak
@pytest.mark.parametrize("lanes", [1, BLOCK_LANES])
@pytest.mark.parametrize(("on", "exponential"), EXPONENTIAL + CLASSICAL)
def test_every_kernel_compiles_to_the_bits_of_its_source(on, exponential, lanes):
    rows = SWITCHED_STATE_ROWS if any(on.values()) else STATE_ROWS
    found = advanced(kernel(lanes, exponential=exponential, **on), rows, on)
    for one, expected_array in zip(found, uncompiled_run(on, exponential), strict=True):
        np.testing.assert_array_equal(one, expected_array)

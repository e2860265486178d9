"""With every switch on or off, the compiled recursion equals the reference equations."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from elbow_gym import dynamics, kernel, motors
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_table
from elbow_gym.table import FRICTION_VELOCITY, TableParameters
from tests.support.comparisons import assert_close, assume_solvable
from tests.support.kernel_calls import accelerations
from tests.support.strategies import between, cases

SWITCHES = [
    {"table": True},
    {"rubbing": True},
    {"drive": True},
    {"table": True, "rubbing": True, "drive": True},
]


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


@pytest.mark.parametrize("switches", SWITCHES, ids="+".join)
@given(data=st.data())
@settings(max_examples=60)
def test_fast_form_equals_the_reference_with_every_switch(switches, data):
    on = {name: switches.get(name, False) for name in ("table", "rubbing", "drive")}
    case = data.draw(rough_cases() if on["drive"] else cases(largest=8))
    under = data.draw(conditions(**on))
    assume_solvable(dynamics.mass_matrix(case.arm, case.q), dynamics.constraint_jacobian(case.arm, case.q, case.elbows))
    rise = np.full(case.arm.n_joints, data.draw(between(0.0, 80.0)) if under.heat else 0.0)
    state = np.zeros((1, kernel.SWITCHED_STATE_ROWS, case.arm.n_joints))
    state[0, :3] = case.q, case.q_dot, case.current
    state[0, kernel.SWITCHED_STATE.index("temperature_rise") + kernel.STATE_ROWS] = rise
    parameters = parameter_table(case.arm, under)[None]
    found = accelerations(1, state, parameters, case.voltage[None], case.elbows, **on)
    for value, reference, tolerance in zip(found, expected(case, under, rise), (1e-9, 1e-9, 1e-12), strict=True):
        assert_close(value[0], reference, tolerance)


def test_smoothing_speeds_are_the_references():
    assert kernel.GEAR_SPEED == motors.COULOMB_VELOCITY
    assert kernel.ELBOW_SPEED == FRICTION_VELOCITY

"""Rates in closed form against eigenvalues of the printed equations, and the steps that are chosen from them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from elbow_gym import ArmParameters, LinkParameters, MotorParameters, TableParameters, dynamics, motors, paper_arm
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_table, quantities
from elbow_gym.simulation.step_limit import (
    INTEGRATORS,
    MOST_SUBSTEPS,
    check_parameters,
    check_timestep,
    limits,
    rates,
    schedule,
    worst_rows,
)

NUDGE = 1e-6
ELBOWS = ((), (4,), (4, 7))
STIFF = {"stiffness": 1e5}


def rates_of(arm, elbows=True, **conditions):
    under = Conditions(**conditions)
    return rates(parameter_table(arm, under), under, elbows=elbows)


def paper_with(**motor):
    return replace(paper_arm(), motors=(MotorParameters(**motor),) * 10)


def jacobian(function, x):
    """Central differences of `function` at `x`, one column per entry of it."""
    return np.stack(
        [(function(x + NUDGE * e) - function(x - NUDGE * e)) / (2.0 * NUDGE) for e in np.eye(x.size)], axis=1
    )


def eigenvalues(arm, q, elbows=(), table=None):
    """Of the printed equations around rest at `q`, where motor currents carry the arm."""
    n = arm.n_joints
    current = dynamics.bias_forces(arm, q, np.zeros(n)) / arm.of_motors("joint_torque_constant")
    voltage = arm.of_motors("armature_resistance") * current

    def slope(x):
        moved = dynamics.forward_dynamics(arm, x[:n], x[n : 2 * n], x[2 * n :], voltage, elbows, table=table)
        return np.concatenate([x[n : 2 * n], moved.q_ddot, moved.current_dot])

    return np.linalg.eigvals(jacobian(slope, np.concatenate([q, np.zeros(n), current])))


def random_arm(generator):
    """Six joints whose constants lie up to a decade apart."""

    def spread(value):
        return float(value * 10.0 ** generator.uniform(-0.5, 0.5))

    return ArmParameters(
        links=tuple(
            LinkParameters(mass=spread(0.1), length=spread(0.3) * (k > 0), radius=spread(0.01)) for k in range(6)
        ),
        motors=tuple(
            MotorParameters(
                armature_resistance=spread(1.1),
                armature_inductance=spread(0.0017),
                torque_constant=spread(0.203),
                rotor_inertia=spread(0.000164),
                gear_ratio=spread(3.0),
                gear_viscous_friction=spread(0.01),
            )
            for _ in range(6)
        ),
        joint_viscous_friction=tuple(spread(0.5) for _ in range(6)),
        nominal_pose=(0.0,) * 6,
    )


@pytest.mark.parametrize("elbows", ELBOWS)
@pytest.mark.slow
def test_no_eigenvalue_of_a_random_arm_is_faster_than_its_rates(elbows):
    # Damping bounds the real parts, the skew coupling the imaginary ones; gravity moves both by its rate at most.
    generator = np.random.default_rng(len(elbows))
    for _ in range(6):
        arm = random_arm(generator)
        held = tuple(e for e in elbows if e <= 6)
        rate = rates_of(arm)
        found = eigenvalues(arm, generator.uniform(-math.pi, math.pi, 6), held)
        assert -found.real.min() < max(rate["armature"], rate["friction"]) + rate["gravity"]
        assert np.abs(found.imag).max() < rate["coupling"] + rate["gravity"]
        assert found.real.max() < rate["gravity"]


@pytest.mark.parametrize("elbows", ELBOWS)
@pytest.mark.slow
def test_the_papers_motors_reach_half_of_their_rates_and_never_all(elbows):
    generator, arm, rate = np.random.default_rng(5), paper_arm(), rates_of(paper_arm())
    poses = (np.array(arm.nominal_pose), generator.uniform(-math.pi, math.pi, 10))
    found = np.concatenate([eigenvalues(arm, q, elbows) for q in poses])
    assert rate["armature"] / 2.0 < -found.real.min() < rate["armature"] * (1.0 + 1e-6)
    assert rate["coupling"] / 2.0 < np.abs(found.imag).max() < rate["coupling"]


@pytest.mark.parametrize("elbows", ELBOWS)
@pytest.mark.slow
def test_friction_slows_an_unpowered_arm_at_half_its_rate_or_more(elbows):
    arm = replace(paper_with(torque_constant=1e-9), gravity=0.0)
    generator, rate = np.random.default_rng(6), rates_of(arm)["friction"]
    found = eigenvalues(arm, generator.uniform(-math.pi, math.pi, 10), elbows)
    mechanical = found[np.abs(found + rates_of(arm)["armature"]) > 1.0]
    assert rate / 2.0 < -mechanical.real.min() < rate * (1.0 + 1e-6)


def test_the_gears_coulomb_friction_adds_its_slope_at_standstill():
    arm = paper_with(gear_coulomb_friction=0.02)
    slope = jacobian(lambda q_dot: -motors.coulomb_friction(arm, q_dot), np.zeros(10))[0, 0]
    viscous = 0.5 + 0.01 * 9.0
    assert rates_of(arm)["friction"] == pytest.approx((viscous + slope) / (0.000164 * 9.0), rel=1e-6)


@pytest.mark.parametrize("length", [0.3, 0.003])
@pytest.mark.parametrize("rotor_inertia", [1e-9, 0.000164])
@pytest.mark.slow
def test_a_stretched_arm_swings_under_gravity_at_its_rate_at_most_and_a_quarter_at_least(length, rotor_inertia):
    # Without friction the eigenvalues around the upright arm are those of the pendulum's modes.
    link = LinkParameters(length=length, radius=length / 30.0)
    arm = replace(
        paper_with(torque_constant=1e-9, rotor_inertia=rotor_inertia, gear_viscous_friction=0.0),
        links=(replace(link, length=0.0), *(link,) * 9),
        joint_viscous_friction=(0.0,) * 10,
    )
    rate = rates_of(arm)["gravity"]
    found = eigenvalues(arm, np.zeros(10))
    assert rate / 4.0 < np.abs(found[np.abs(found + 1.1 / 0.0017) > 1.0]).max() < rate


@given(st.floats(0.01, 1e3), st.floats(0.01, 1e3))
def test_the_slow_root_of_a_coupled_motor_is_within_a_factor_of_two_of_its_rate(inductance, inertia):
    # With v = 0 and no friction J q_ddot = K i, L i_dot = -R i - K q_dot: s^2 + (R / L) s + K^2 / (J L) = 0.
    arm = paper_with(torque_constant=1.0, gear_ratio=1.0, armature_resistance=1.0, armature_inductance=inductance,
                     rotor_inertia=inertia)  # fmt: skip
    slow = np.abs(np.roots([1.0, 1.0 / inductance, 1.0 / (inertia * inductance)])).min()
    assert slow <= rates_of(arm)["slow coupling"] * (1.0 + 1e-9)
    assert slow >= rates_of(arm)["slow coupling"] / 2.0 * (1.0 - 1e-9)


@given(st.floats(0.0, 5.0), st.floats(1e-4, 1e2))
def test_a_motor_rings_at_its_rate_where_neither_winding_nor_friction_damps_it(resistance, inertia):
    # J q_ddot = K i - D q_dot, L i_dot = -R i - K q_dot, here with K = L = 1 and D / J = R / L / 2.
    arm = paper_with(torque_constant=1.0, gear_ratio=1.0, armature_resistance=resistance + 1e-3,
                     armature_inductance=1.0, rotor_inertia=inertia, gear_viscous_friction=0.0)  # fmt: skip
    arm = replace(arm, joint_viscous_friction=(resistance * inertia / 2.0,) * 10)
    motor = np.array([[-resistance / 2.0, 1.0 / math.sqrt(inertia)], [-1.0 / math.sqrt(inertia), -resistance]])
    found = rates_of(arm)["ringing"]
    assert found <= np.abs(np.linalg.eigvals(motor).imag).max() + 1e-6
    if resistance == 0.0:
        assert found == pytest.approx(1.0 / math.sqrt(inertia), rel=1e-3)


def test_a_shared_supply_makes_equal_motors_as_fast_as_armature_and_supply_together():
    arm, resistance = paper_arm(), 0.13
    commands = 24.0 * np.array([1.0, -1.0] * 5)

    def slope(current):
        voltage = motors.terminal_voltage(commands, current, 24.0, resistance)
        return (voltage - 1.1 * current) / 0.0017

    rate = rates_of(arm, supply_resistance=resistance)
    assert -np.linalg.eigvals(jacobian(slope, np.ones(10))).real.min() == pytest.approx(rate["armature"], rel=1e-6)
    assert rate["supply"] == pytest.approx(10.0 * resistance / 0.0017)


@pytest.mark.parametrize("heat_capacity", [0.01, 0.2, 20.0])
@pytest.mark.parametrize("inductance", [0.0017, 0.5])
def test_a_stalled_winding_warms_up_within_its_rates(heat_capacity, inductance):
    arm = paper_with(heat_capacity=heat_capacity, armature_inductance=inductance)
    rate = rates_of(arm, heat=True)

    def slope(x):
        current, rise = x[:1], x[1:]
        resistance = motors.armature_resistance(arm, rise)[0]
        return np.array([(24.0 - resistance * current[0]) / inductance, motors.temperature_rate(arm, current, rise)[0]])

    cold = np.linalg.eigvals(jacobian(slope, np.array([24.0 / 1.1, 0.0])))
    assert np.abs(cold).min() < rate["cooling"] + rate["heating"]
    # Where it settles: R_th V0^2 = R (1 + alpha T) T.
    rise = (math.sqrt(1.0 + 4.0 * 0.00393 * 5.0 * 24.0**2 / 1.1) - 1.0) / (2.0 * 0.00393)
    resistance = 1.1 * (1.0 + 0.00393 * rise)
    np.testing.assert_allclose(slope(np.array([24.0 / resistance, rise])), 0.0, atol=1e-9 / inductance)
    assert rate["armature"] == pytest.approx(resistance / inductance)


def test_a_link_struck_at_its_end_swings_at_the_tables_rate():
    # The last link alone lies on the table; all others are far heavier, and rotors and motors do nothing.
    table = TableParameters(stiffness=1e5, dissipation=0.0)
    heavy = LinkParameters(mass=1e9, radius=1.0)
    arm = ArmParameters(
        links=(replace(heavy, length=0.0), heavy, heavy, LinkParameters()),
        motors=(MotorParameters(rotor_inertia=1e-12, torque_constant=1e-9, gear_viscous_friction=0.0),) * 4,
        joint_viscous_friction=(0.0,) * 4,
        nominal_pose=(0.0,) * 4,
        gravity=0.0,
    )
    height = 0.3 * (1.0 + math.cos(math.pi - 0.1))
    q = np.array([0.0, 0.0, math.pi - 0.1, math.acos((-1e-5 - height) / 0.3) - (math.pi - 0.1)])
    found = np.abs(eigenvalues(arm, q, table=table).imag).max()
    rate = rates_of(arm, table=table)["table"]
    assert rate / 2.0 < found < rate
    assert rate == pytest.approx(2.0 * math.sqrt(1e5 / 0.1), rel=0.01)


def test_what_is_off_has_no_rate():
    rate = rates_of(paper_arm())
    assert {name for name, value in rate.items() if value == 0.0} == {
        "supply", "ringing", "cooling", "heating", "table", "dissipation", "sliding", "rubbing",
    }  # fmt: skip
    assert rates_of(paper_arm(), elbow_friction=0.1)["rubbing"] > 0.0
    assert rates_of(paper_arm(), elbows=False, elbow_friction=0.1)["rubbing"] == 0.0


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
    np.testing.assert_allclose(schedule(0.02, paper, "rk4"), np.full(10, 0.002))
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
    assert (substeps.size - 4) * longest < period


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
    found = rates_of(paper_with(rotor_inertia=1e-300, torque_constant=1e200))
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


RANGES = {
    "mass": (0.5, 2.0),
    "length": (0.8, 1.1),
    "joint_viscous_friction": (0.0, 3.0),
    "torque_constant": (0.5, 2.0),
    "armature_resistance": (0.3, 3.0),
    "supply_voltage": (0.5, 1.5),
    "payload": (0.0, 0.5),
    "gear_viscous_friction": 2.0,
    "action_delay": (0.0, 3.0),
}


def drawn_arm(generator):
    """An arm of `RANGES`, every link and motor drawn for itself, with its payload and its V0."""

    def draw(name, count=None):
        span = RANGES.get(name, 1.0)
        return generator.choice(span, count) if isinstance(span, tuple) else np.full(count or (), span)

    paper = paper_arm()
    factor = {name: draw(name, 10) for name in quantities(paper)}
    arm = replace(
        paper,
        links=tuple(
            replace(link, mass=link.mass * factor["mass"][k], length=link.length * factor["length"][k])
            for k, link in enumerate(paper.links)
        ),
        motors=tuple(
            replace(
                motor,
                torque_constant=motor.torque_constant * factor["torque_constant"][k],
                armature_resistance=motor.armature_resistance * factor["armature_resistance"][k],
                gear_viscous_friction=2.0 * motor.gear_viscous_friction,
            )
            for k, motor in enumerate(paper.motors)
        ),
        joint_viscous_friction=tuple(0.5 * factor["joint_viscous_friction"]),
    )
    return arm, {"payload": float(draw("payload")), "supply_voltage": 24.0 * float(draw("supply_voltage"))}


def test_rates_at_the_ranges_ends_cover_every_draw():
    switches = {"heat": True, "supply_resistance": 0.1, "table": {**STIFF, "friction": 0.3}, "elbow_friction": 0.2}
    nominal = Conditions(payload=0.2, **switches)
    rows, volts = worst_rows(quantities(paper_arm()), 9.81, nominal, RANGES)
    worst = rates(rows, nominal, volts)
    assert volts == 36.0
    generator = np.random.default_rng(3)
    for _ in range(50):
        arm, drawn = drawn_arm(generator)
        for name, rate in rates_of(arm, **switches, **drawn).items():
            assert rate <= worst[name] * (1.0 + 1e-9), name
    # Some are reached: by the lightest link, the strongest magnet, the most friction.
    assert worst["table"] == pytest.approx(2.0 * math.sqrt(1e5 / 0.05), rel=0.01)
    assert worst["coupling"] == pytest.approx(2.0 * rates_of(paper_arm())["coupling"])
    assert worst["friction"] == pytest.approx((3.0 * 0.5 + 2.0 * 0.09) / (0.000164 * 9.0))


def test_without_ranges_the_worst_arm_is_the_nominal_one():
    under = Conditions(payload=0.2, heat=True, supply_resistance=0.1)
    rows, volts = worst_rows(quantities(paper_arm()), 9.81, under, {})
    np.testing.assert_array_equal(rows, np.stack([parameter_table(paper_arm(), under)] * 2))
    assert volts == 24.0


def test_an_arms_own_parameters_that_the_steps_do_not_resolve_are_refused_by_name():
    step = float(schedule(0.02, rates_of(paper_arm()), "exponential").max())
    check_parameters(step, rates_of(paper_arm()), "exponential")
    stiff = replace(paper_arm(), joint_viscous_friction=(0.5,) * 9 + (5.0,))
    with pytest.raises(
        ValueError,
        match=r"^options\['parameters'\] must allow substeps of 0\.0055 s, got 0\.000638 s at most, for the rate "
        r"'friction' of 3449 1/s",
    ):
        check_parameters(step, rates_of(stiff), "exponential")

"""Rates in closed form against eigenvalues of the printed equations, and over what may be drawn."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from elbow_gym import ArmParameters, LinkParameters, MotorParameters, TableParameters, dynamics, motors, paper_arm
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_table, quantities
from elbow_gym.simulation.rates import Start, rates, worst_rows

NUDGE = 1e-6
ELBOWS = ((), (4,), (4, 7))
STIFF = {"stiffness": 1e5}


def rates_of(arm, elbows=True, start=None, duration=math.inf, **conditions):
    under = Conditions(**conditions)
    return rates(parameter_table(arm, under), under, elbows=elbows, start=start, duration=duration)


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


@pytest.mark.slow
@pytest.mark.parametrize("elbows", ELBOWS)
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


@pytest.mark.slow
@pytest.mark.parametrize("elbows", ELBOWS)
def test_the_papers_motors_reach_half_of_their_rates_and_never_all(elbows):
    generator, arm, rate = np.random.default_rng(5), paper_arm(), rates_of(paper_arm())
    poses = (np.array(arm.nominal_pose), generator.uniform(-math.pi, math.pi, 10))
    found = np.concatenate([eigenvalues(arm, q, elbows) for q in poses])
    assert rate["armature"] / 2.0 < -found.real.min() < rate["armature"] * (1.0 + 1e-6)
    assert rate["coupling"] / 2.0 < np.abs(found.imag).max() < rate["coupling"]


@pytest.mark.slow
@pytest.mark.parametrize("elbows", ELBOWS)
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


@pytest.mark.slow
@pytest.mark.parametrize("length", [0.3, 0.003])
@pytest.mark.parametrize("rotor_inertia", [1e-9, 0.000164])
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


@given(st.floats(0.01, 1e3), st.floats(0.01, 1e3), st.floats(0.0, 10.0))
def test_the_slow_root_of_a_coupled_motor_is_below_its_rate_and_more_so_without_friction(inductance, inertia, damping):
    # With v = 0, K = R = 1 and no friction J q_ddot = i, L i_dot = -i - q_dot: s^2 + s / L + 1 / (J L) = 0.
    arm = paper_with(torque_constant=1.0, gear_ratio=1.0, armature_resistance=1.0, armature_inductance=inductance,
                     rotor_inertia=inertia, gear_viscous_friction=0.0)  # fmt: skip
    slow = np.abs(np.roots([1.0, 1.0 / inductance, 1.0 / (inertia * inductance)])).min()
    free = rates_of(replace(arm, joint_viscous_friction=(0.0,) * 10))["slow coupling"]
    damped = rates_of(replace(arm, joint_viscous_friction=(damping * slow * inertia,) * 10))["slow coupling"]
    assert slow * (1.0 - 1e-9) <= free / 2.0 <= 2.0 * slow * (1.0 + 1e-9)
    assert damped == pytest.approx(free - min(damping * slow, free / 2.0), rel=1e-9)


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
    # In five seconds it comes near that where it holds little heat, else near what heat makes of it that never leaves.
    warming = solve_ivp(
        lambda _, x: motors.temperature_rate(arm, 24.0 / motors.armature_resistance(arm, x)[:1], x)[:1],
        (0.0, 5.0),
        [0.0],
    )
    reached = motors.armature_resistance(arm, warming.y[:, -1])[0] / inductance
    assert 0.95 * rates_of(arm, heat=True, duration=5.0)["armature"] < reached
    assert reached <= rates_of(arm, heat=True, duration=5.0)["armature"] <= rate["armature"]


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


def test_the_hand_turns_at_most_as_fast_as_all_pitch_joints_run_free():
    # Free of load a motor's torque is its friction: K (V0 - K s) / R = D s.
    constant, friction = 0.203 * 3.0, 0.5 + 0.01 * 9.0
    rate = rates_of(paper_arm())
    assert constant * (24.0 - constant * rate["speed"] / 9.0) / 1.1 == pytest.approx(friction * rate["speed"] / 9.0)
    spinning = replace(paper_arm(), gravity=(rate["speed"] / 9.0) ** 2 * 0.3)
    assert rate["whirl"] == pytest.approx(rates_of(spinning)["gravity"])


@pytest.mark.parametrize("dissipation", [0.02, 0.5, 20.0])
def test_a_link_that_falls_on_the_table_is_braked_at_its_rate_at_most(dissipation):
    # A link's end meets the table at the free speed of a joint: m z_ddot = k z (1 + c z_dot), downward.
    table = {"stiffness": 1e5, "dissipation": dissipation}
    arm = replace(paper_arm(), gravity=0.0)
    found = rates_of(arm, table=table)
    mass, speed = 1e5 / found["table"] ** 2, found["speed"] / 9.0 * 0.3

    def slope(_, x):
        force = 1e5 * x[0] * max(0.0, 1.0 + dissipation * x[1])
        return [x[1], -force / mass]

    run = solve_ivp(slope, (0.0, 5e-3), [0.0, speed], rtol=1e-8, atol=1e-12, max_step=1e-5)
    braking = dissipation * 1e5 * run.y[0].max() / mass
    assert found["dissipation"] / 6.0 < braking < found["dissipation"]


def test_what_is_off_has_no_rate():
    rate = rates_of(paper_arm())
    assert {name for name, value in rate.items() if value == 0.0} == {
        "supply", "ringing", "cooling", "heating", "table", "dissipation", "sliding", "rubbing",
    }  # fmt: skip
    assert rates_of(paper_arm(), elbow_friction=0.1)["rubbing"] > 0.0
    assert rates_of(paper_arm(), elbows=False, elbow_friction=0.1)["rubbing"] == 0.0


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


def test_rates_at_the_ranges_ends_cover_a_thick_link_that_swings_fastest_between_them():
    # l / (r^2 / 4 + l^2 / 12) is largest at l = sqrt(3) r, here the nominal length.
    arm = paper_with(rotor_inertia=1e-12)
    links = (arm.links[0], *(replace(link, radius=link.length / math.sqrt(3.0)) for link in arm.links[1:]))
    arm = replace(arm, links=links)
    rows, volts = worst_rows(quantities(arm), 9.81, Conditions(), {"length": (0.2, 5.0)})
    worst, nominal = rates(rows, Conditions(), volts), rates_of(arm)
    assert worst["gravity"] == pytest.approx(nominal["gravity"], rel=1e-9)
    # Whirl has the longest link's length for a lever, too.
    assert worst["whirl"] == pytest.approx(math.sqrt(5.0) * nominal["whirl"], rel=1e-9)


def test_a_motor_of_next_to_no_constant_comes_to_no_speed_though_nothing_brakes_it():
    idle = replace(paper_with(torque_constant=1e-12, gear_viscous_friction=0.0), joint_viscous_friction=(0.0,) * 10)
    # An hour of K V0 / (R J), for nine pitch joints.
    hour = 3600.0 * 3e-12 * 24.0 / (1.1 * 0.000164 * 9.0)
    assert rates_of(idle)["speed"] == pytest.approx(9.0 * hour)
    strong = replace(idle, motors=(MotorParameters(torque_constant=1.0, gear_viscous_friction=0.0),) * 10)
    assert rates_of(strong)["speed"] == pytest.approx(9.0 * 24.0 / 3.0)


def start_of(q_dot=0.0, current=0.0, rise=0.0):
    """All of ten joints alike."""
    return Start(*(np.full((1, 10), value) for value in (q_dot, current, rise)))


def test_a_start_counts_with_its_speed_its_current_and_its_warmth_beyond_those_of_a_run():
    arm, rest = paper_arm(), rates_of(paper_arm(), heat=True)
    assert rates_of(arm, heat=True, start=start_of(30.0, 43.0, 300.0)) == rest
    fast = rates_of(arm, heat=True, start=start_of(300.0))
    assert fast["speed"] == pytest.approx(9.0 * 300.0 / 3.0)
    assert fast["whirl"] == pytest.approx(rest["whirl"] * 100.0 / (rest["speed"] / 9.0))
    assert {name for name in rest if fast[name] != rest[name]} == {"speed", "whirl"}
    # All of an inductance's energy in the rotor, L i^2 = J q_dot^2.
    driven = rates_of(arm, heat=True, start=start_of(current=-1e3 - 2.0 * 24.0 / 1.1))
    assert driven["speed"] == pytest.approx(9.0 * math.sqrt(0.0017 / (0.000164 * 9.0)) * 1e3 / 3.0)
    hot = rates_of(arm, heat=True, start=start_of(rise=1e4))
    assert hot["armature"] == pytest.approx(1.1 * (1.0 + 0.00393 * 1e4) / 0.0017)
    # A second more of 24^2 V^2 / R in 20 J/K, at a resistance that grows.
    warmer = rates_of(arm, heat=True, start=start_of(rise=100.0), duration=1.0)["armature"]
    growth = (0.0017 / 1.1 * warmer) ** 2 - (1.0 + 0.00393 * 100.0) ** 2
    assert growth == pytest.approx(2.0 * 0.00393 * 24.0**2 / (1.1 * 20.0))
    # Joints that start fast hit the table fast.
    falling = rates_of(arm, table=True, start=start_of(300.0))["dissipation"]
    assert falling > 2.0 * rates_of(arm, table=True)["dissipation"]


def test_friction_counts_the_weight_or_a_fifth_of_a_stalled_motors_force_on_the_end_of_its_link():
    arm, table = paper_arm(), {"friction": 0.3}
    weight = rates_of(arm, table=table, elbow_friction=0.1)
    # All weigh 9.81 N on a link of 0.1 kg; a motor presses with 3 * 0.203 * 24 / 1.1 / 0.3 = 44 N.
    assert weight["sliding"] == pytest.approx(0.3 * 9.81 / (0.1 * 0.01))
    assert weight["rubbing"] == pytest.approx(0.1 * 9.81 / (0.1 * 0.01))
    strong = rates_of(arm, table=table, elbow_friction=0.1, supply_voltage=240.0)
    pressing = 0.2 * 3.0 * 0.203 * 240.0 / 1.1 / 0.3
    assert strong["sliding"] == pytest.approx(0.3 * pressing / (0.1 * 0.01))
    assert strong["rubbing"] == pytest.approx(0.1 * pressing / (0.1 * 0.01))

"""Whole runs on the compliant table: it never pulls, no joule is missing, runs converge to another integrator's."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from elbow_gym import (
    Conditions,
    MotorParameters,
    Simulator,
    TableParameters,
    contact,
    dynamics,
    kinematics,
    paper_arm,
)
from tests.support.arms import inductor_energy, lying, mechanical_energy, small_arm, uneven_arm

ROUGH, SMOOTH = {"friction": 0.3}, {"friction": 0.0}
DRIVE = {"heat": True, "supply_resistance": 0.2}
CASES = {
    "table": {"table": ROUGH},
    "smooth table": {"table": SMOOTH},
    "table and elbows": {"elbows": (4, 7), "table": ROUGH},
    "rubbing elbows": {"elbows": (4, 7), "elbow_friction": 0.3},
    "drive": {"elbows": (4, 7), **DRIVE},
    "all": {"elbows": (4, 7), "table": ROUGH, "elbow_friction": 0.2, "payload": 0.3, **DRIVE},
}


def hand_velocity(sim):
    """Of one arm [m/s], (3,), by central differences."""
    ahead, behind = (kinematics.hand_position(sim.arm, sim.q[0] + dt * sim.q_dot[0]) for dt in (1e-6, -1e-6))
    return (ahead - behind) / 2e-6


def stored(sim):
    """Kinetic, potential and elastic energy of one arm, its payload and its inductors [J]."""
    payload, table = sim.conditions.payload, sim.conditions.surface
    elastic = contact.contact_energy(sim.arm, table, sim.q[0]).sum() if table else 0.0
    load = payload * (sim.arm.gravity * sim.hand_position[0, 2] + (hand_velocity(sim) ** 2).sum() / 2.0)
    return mechanical_energy(sim) + load + elastic + inductor_energy(sim).sum()


@cache
def ride(case):
    """A quarter of a second under random voltages from a pose on the table: the simulator and what it did.

    That is what its stores gained, what sum u i came to by the trapezoidal rule, and contact forces and losses after
    each step.
    """
    options = dict(CASES[case])
    arm, elbows = uneven_arm(), options.pop("elbows", 0)
    if "heat" in options:
        rough = tuple(replace(motor, gear_coulomb_friction=0.002) for motor in arm.motors)
        arm = replace(arm, motors=rough)
    sim = Simulator(arm, elbows, conditions=Conditions(**options), timestep=1e-4)
    rng = np.random.default_rng(4)
    sim.reset(Simulator(uneven_arm(), (4, 7), timestep=1e-4).on_table(arm.nominal_pose))
    before, fed, forces, losses = stored(sim), 0.0, [], []
    for _ in range(25):
        voltage = rng.uniform(-9.0, 9.0, 10)
        for _ in range(100):
            power = voltage @ sim.current[0]
            sim.step(voltage)
            fed += sim.timestep * (power + voltage @ sim.current[0]) / 2.0
            forces.append(sim.contact_force[0])
            losses.append(sim.contact_loss[0].copy())
    return sim, stored(sim) - before, fed, np.array(forces), np.array(losses)


@pytest.mark.parametrize("case", CASES)
def test_energy_in_is_stored_or_lost(case):
    sim, gained, *_ = ride(case)
    lost = sim.copper_loss.sum() + sim.friction_loss.sum() + sim.contact_loss.sum()
    assert abs(sim.electrical_energy.sum() - lost - gained) < 1e-6 * sim.drawn_energy.sum()
    assert sim.drawn_energy.sum() > 30.0
    if case not in {"drive", "table and elbows"}:
        assert sim.contact_loss.sum() > 0.05


@pytest.mark.parametrize("case", ["drive", "all"])
def test_the_supply_feeds_motors_and_its_own_resistance(case):
    # V0 I = sum u i, by the trapezoidal rule, is sum v i + R_s I^2.
    sim, _, fed, *_ = ride(case)
    assert fed == pytest.approx(sim.electrical_energy.sum() + sim.supply_loss[0], rel=2e-4)
    assert sim.supply_loss[0] > 1.0


@pytest.mark.parametrize("case", CASES)
def test_contacts_push_rub_against_the_sliding_and_only_take_energy(case):
    *_, forces, losses = ride(case)
    assert (forces[..., 2] >= 0.0).all()
    assert (np.diff(losses, axis=0) >= 0.0).all()
    assert forces.any() == ("table" in case or case == "all")
    rubbing = np.hypot(forces[..., 0], forces[..., 1])
    friction = CASES[case].get("table", SMOOTH)["friction"]
    assert (rubbing <= friction * forces[..., 2]).all()
    assert rubbing.any() == (friction > 0.0)


def unpowered(arm, **table):
    """One arm without motors' braking or any friction of its own, on a table, at 0.02 ms."""
    idle = MotorParameters(torque_constant=1e-12, gear_viscous_friction=0.0)
    loose = replace(arm, motors=(idle,) * arm.n_joints, joint_viscous_friction=(0.0,) * arm.n_joints)
    # Of a supply that gives next to nothing, such motors do not speed up without end.
    return Simulator(loose, 0, conditions=Conditions(table=table, supply_voltage=1e-12), timestep=2e-5)


@pytest.mark.parametrize(("dissipation", "friction"), [(0.5, 0.0), (0.0, 0.3), (1.0, 0.3)])
def test_a_bounce_takes_what_the_contacts_lose_and_never_gives_energy(dissipation, friction):
    sim = unpowered(small_arm(), stiffness=1e4, dissipation=dissipation, friction=friction)
    sim.reset(lying(sim.arm, 0.03, 0.02), [0.5, 0.0, 0.0])
    energies, pressed = [stored(sim)], []
    for _ in range(250):
        sim.step(np.zeros(3), 50)
        energies.append(stored(sim))
        pressed.append(sim.contact_force[0, :, 2].any())
    assert np.diff(pressed).sum() > 3
    # The integrator's own error where contact begins.
    assert np.diff(energies).max() < 1e-7
    assert energies[0] - energies[-1] == pytest.approx(sim.contact_loss.sum(), abs=1e-6)
    assert sim.contact_loss.sum() > 0.01


def test_an_elastic_smooth_table_gives_back_all_it_took():
    sim = unpowered(small_arm(), stiffness=1e4, dissipation=0.0)
    sim.reset(lying(sim.arm, 0.03, 0.02))
    before, deepest = stored(sim), 0.0
    for _ in range(250):
        sim.step(np.zeros(3), 50)
        deepest = min(deepest, sim.lowest_height[0])
    assert deepest < -0.001
    assert stored(sim) == pytest.approx(before, abs=1e-6)
    assert np.abs(sim.contact_loss).max() < 1e-9


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_dropped_arm_comes_to_rest_at_the_depth_that_carries_it(friction):
    stiffness = 2e4
    table = Conditions(table={"stiffness": stiffness, "friction": friction})
    sim = Simulator(small_arm(), 0, conditions=table, timestep=2e-4)
    sim.reset(lying(sim.arm, 0.05, 0.03))
    sim.step(np.zeros(3), 20_000)
    # Joint 3 carries half of both links, the hand half of the last one; the base carries the rest.
    loads = np.array([(0.4 + 0.2) * 9.81 / 2.0, 0.2 * 9.81 / 2.0])
    np.testing.assert_allclose(sim.contact_force[0, :, 2], loads, rtol=1e-5)
    np.testing.assert_allclose(kinematics.joint_positions(sim.arm, sim.q[0])[2:, 2], -loads / stiffness, rtol=1e-5)


def test_the_papers_arm_lying_flat_rests_on_every_joint_with_a_links_weight():
    sim = Simulator(paper_arm(), 0, conditions=Conditions(table=True), timestep=5e-4)
    sim.reset(np.pi / 2.0 * np.eye(10)[1])
    sim.step(np.zeros(10), 10_000)
    # Each joint carries half of the two links that meet there, the hand half of the last one.
    weight = 0.1 * 9.81
    np.testing.assert_allclose(sim.contact_force[0, :, 2], [weight] * 8 + [weight / 2.0], rtol=1e-4)
    assert sim.below_table[0] == 0.0


@pytest.mark.slow
def test_runs_converge_to_the_reference_equations_integrated_elsewhere():
    arm, table = small_arm(), TableParameters(stiffness=2e4, friction=0.3)
    start, q_dot = lying(arm, 0.003, 0.001), np.array([1.0, 0.5, 0.4])
    voltage = np.array([0.5, -1.0, 0.8])

    def rates(_, state):
        q, q_dot, current = state.reshape(3, 3)
        found = dynamics.forward_dynamics(arm, q, q_dot, current, voltage, table=table)
        return np.concatenate([q_dot, found.q_ddot, found.current_dot])

    first = np.concatenate([start, q_dot, np.zeros(3)])
    # Short steps find the instants at which contact begins and ends.
    exact = solve_ivp(rates, (0.0, 0.02), first, method="DOP853", rtol=1e-11, atol=1e-12, max_step=4e-4).y[:, -1]
    for timestep, error in ((2e-4, 3e-4), (1e-4, 3e-5), (1e-5, 2e-6)):
        sim = Simulator(arm, 0, conditions=Conditions(table=table), timestep=timestep)
        sim.reset(start, q_dot)
        sim.step(voltage, round(0.02 / timestep))
        found = np.concatenate([sim.q[0], sim.q_dot[0], sim.current[0]])
        np.testing.assert_allclose(found, exact, rtol=0.0, atol=error)
    assert sim.contact_loss.sum() > 1e-3


@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("elbows", [0, 2])
def test_the_table_never_pulls_through_seconds_of_full_voltage(elbows, friction):
    sim = Simulator("paper", elbows, 32, conditions=Conditions(table={"friction": friction}), timestep=5e-4)
    rng, loss, pressed = np.random.default_rng(1), sim.contact_loss.copy(), 0.0
    for k in range(150):
        bang = 24.0 * rng.choice([-1.0, 1.0], (32, 10))
        sim.step(bang if k % 2 else rng.uniform(-24.0, 24.0, (32, 10)), 40)
        assert sim.valid.all()
        assert (sim.contact_force[..., 2] >= 0.0).all()
        assert (sim.contact_loss >= loss).all()
        loss, pressed = sim.contact_loss.copy(), pressed + sim.contact_force[..., 2].sum()
    assert pressed > 100.0


@pytest.mark.parametrize(
    ("table", "limit"), [(True, 0.000784), ({"stiffness": 5e3}, 0.00157), ({"stiffness": 3.2e5}, 0.000196)]
)
def test_a_step_too_long_for_the_table_is_refused(table, limit):
    # In proportion to 1 / sqrt(stiffness).
    with pytest.raises(ValueError, match=rf"^timestep must be at most {limit} s, for the rate 'table' .*, got 0.002$"):
        Simulator("paper", 0, conditions=Conditions(table=table), timestep=0.002)
    Simulator("paper", 0, conditions=Conditions(table=table), timestep=0.99 * limit)


def test_an_elbow_that_friction_jams_is_told():
    # Elbow 4 slides under two links that are `lean` from upright; where it jams, friction has no force to agree with.
    arm, under = paper_arm(), Conditions(table=True, elbow_friction=0.3, heat=True, supply_resistance=0.1)
    sim = Simulator(arm, 1, conditions=under, timestep=5e-4)

    def slide(lean, speed):
        q, q_dot = np.zeros(10), np.zeros(10)
        q[1:4], q_dot[1:4] = (lean, np.pi - 2.0 * lean, lean + 0.5 - np.pi), (speed, -2.0 * speed, speed)
        sim.reset(q, q_dot)
        zero = np.zeros(10)
        found = dynamics.forward_dynamics(arm, q, q_dot, zero, zero, (4,), table=TableParameters(), elbow_friction=0.3)
        return sim.constraint_residual[0], sim.elbow_force[0] - found.elbow_force

    for lean, speed in ((0.02, -1.0), (0.05, 1.0), (0.3, 1.0), (0.3, -1.0), (0.7, 1.0)):
        residual, wrong = slide(lean, speed)
        assert residual < 1e-12
        assert np.abs(wrong).max() < 1e-8
    assert slide(0.02, 1.0)[0] > 0.1


@pytest.mark.parametrize("lean", [0.1, 0.1037, 0.1063])
def test_rubbing_elbows_on_links_that_fold_up_hold_the_yaw_and_lose_no_joule(lean):
    # Links 3 and 4 lie on each other and swing through upright, where elbow 3 pushes and elbow 5 pulls without bound:
    # friction then holds the yaw still for an instant, faster than any step resolves, and lets go of it.
    under = Conditions(table=True, elbow_friction=0.3, heat=True, supply_resistance=0.1)
    sim = Simulator("paper", (3, 5), conditions=under, timestep=4e-4)
    pitch = np.array([np.pi / 2.0, -lean, np.pi - lean, *[0.2] * 6])
    volts = np.array([24.0, 0.0, 24.0, 0.0, -24.0, *[0.0] * 5])
    sim.reset([0.0, *np.diff(pitch, prepend=0.0)], volts / 3.0 * [0.0, *[1.0] * 9])
    before, pushed = stored(sim), 0.0
    for _ in range(100):
        sim.step(volts)
        pushed = max(pushed, sim.elbow_force.max())
    assert np.cumsum(sim.q[0, 1:])[1] > 0.3
    assert pushed > 200.0
    assert sim.constraint_residual[0] < 1e-9
    lost = sum(loss.sum() for loss in (sim.copper_loss, sim.friction_loss, sim.contact_loss))
    drawn = sim.electrical_energy.sum()
    assert abs(drawn - lost - stored(sim) + before) < 3e-4 * drawn
    # Steps of 0.01 ms come to 0.0210 to 0.0232 J.
    assert 0.02 < sim.contact_loss.sum() < 0.035

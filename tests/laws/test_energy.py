"""What every run obeys: energy is conserved, elbows stay put and do no work, RK4 converges as RK4 does."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from elbow_gym import ArmParameters, LinkParameters, MotorParameters, Simulator, dynamics, kinematics, paper_arm

ELBOWS = [0, 1, 2, (3, 5), (4, 7, 9)]
BEYOND_THE_PAPER = {
    "gear_coulomb_friction", "thermal_resistance", "heat_capacity", "temperature_coefficient", "temperature_limit",
}  # fmt: skip


def uneven_arm():
    """The paper's arm with every one of its constants scaled by its own factor at every joint."""
    rng = np.random.default_rng(7)

    def scattered(part):
        return {
            name: value * rng.uniform(0.7, 1.4) for name, value in vars(part).items() if name not in BEYOND_THE_PAPER
        }

    arm = paper_arm()
    return ArmParameters(
        links=tuple(LinkParameters(**scattered(link)) for link in arm.links),
        motors=tuple(MotorParameters(**scattered(motor)) for motor in arm.motors),
        joint_viscous_friction=tuple(rng.uniform(0.1, 0.6, 10)),
        nominal_pose=arm.nominal_pose,
    )


def shortened(arm, n):
    per_joint = ("links", "motors", "joint_viscous_friction", "nominal_pose")
    return replace(arm, **{name: getattr(arm, name)[:n] for name in per_joint})


def started(sim, seed=0):
    """Puts one arm on its elbows, moving along the table at random rates; returns the random generator."""
    rng = np.random.default_rng(seed)
    n = sim.arm.n_joints
    q = sim.on_table(sim.arm.nominal_pose + 0.1 * rng.normal(size=n))
    jacobian = kinematics.constraint_jacobian(sim.arm, q[0], sim.elbows)
    q_dot = (np.eye(n) - np.linalg.pinv(jacobian) @ jacobian) @ rng.normal(size=n)
    sim.reset(q, q_dot, rng.normal(size=n))
    return rng


def mechanical_energy(sim):
    """Kinetic energy of links and rotors plus potential energy of the links [J]."""
    q, q_dot = sim.q[0], sim.q_dot[0]
    z = kinematics.joint_positions(sim.arm, q)[:, 2]
    potential = sim.arm.gravity * sim.arm.of_links("mass") @ (z[1:] + z[:-1]) / 2.0
    return q_dot @ dynamics.mass_matrix(sim.arm, q) @ q_dot / 2.0 + potential


def rotor_energy(sim):
    return sim.arm.of_motors("reflected_inertia") * sim.q_dot[0] ** 2 / 2.0


def inductor_energy(sim):
    return sim.arm.of_motors("armature_inductance") * sim.current[0] ** 2 / 2.0


def energies(sim):
    return mechanical_energy(sim), rotor_energy(sim), inductor_energy(sim)


@pytest.fixture(params=ELBOWS, ids=str, scope="module")
def ride(request):
    """Half a second under random voltages at 0.1 ms: the simulator and what its stores gained."""
    sim = Simulator(uneven_arm(), request.param, timestep=1e-4)
    rng = started(sim)
    before = energies(sim)
    for _ in range(25):
        sim.step(rng.uniform(-24.0, 24.0, 10), 200)
    return sim, [after - first for after, first in zip(energies(sim), before, strict=True)]


def test_energy_in_is_stored_or_lost(ride):
    sim, (mechanical, _, inductors) = ride
    lost = sim.copper_loss.sum() + sim.friction_loss.sum()
    residual = sim.electrical_energy.sum() - lost - mechanical - inductors.sum()
    assert abs(residual) < 1e-6 * sim.drawn_energy.sum()
    assert sim.drawn_energy.sum() > 100.0


def test_rigid_elbows_do_no_work_and_links_get_what_motors_give(ride):
    sim, (mechanical, rotors, _) = ride
    friction = np.array(sim.arm.joint_viscous_friction)
    at_joint = sim.friction_loss[0] * friction / (friction + sim.arm.of_motors("reflected_viscous_friction"))
    residual = sim.link_work.sum() - (mechanical - rotors.sum()) - at_joint.sum()
    assert abs(residual) < 1e-6 * sim.drawn_energy.sum()


def test_each_motors_energy_splits_into_copper_inductor_rotor_gear_and_link(ride):
    sim, (_, rotors, inductors) = ride
    gear = sim.arm.of_motors("reflected_viscous_friction")
    in_gear = sim.friction_loss[0] * gear / (gear + np.array(sim.arm.joint_viscous_friction))
    taken = sim.copper_loss[0] + inductors + rotors + in_gear + sim.link_work[0]
    np.testing.assert_allclose(sim.electrical_energy[0], taken, rtol=0.0, atol=1e-6 * sim.drawn_energy[0].max())


def test_unpowered_frictionless_arm_conserves_energy():
    # A motor that hardly couples and a gear without friction leave the links and rotors to themselves.
    idle = MotorParameters(torque_constant=1e-12, gear_viscous_friction=0.0)
    arm = replace(paper_arm(), motors=(idle,) * 10, joint_viscous_friction=(0.0,) * 10)
    for elbows in (0, 2):
        sim = Simulator(arm, elbows, timestep=2e-4)
        started(sim)
        before, height = mechanical_energy(sim), sim.hand_position[0, 2]
        sim.step(np.zeros(10), 2000)
        assert mechanical_energy(sim) == pytest.approx(before, rel=1e-7)
        assert abs(sim.hand_position[0, 2] - height) > 0.1
        assert not sim.friction_loss.any()


@pytest.mark.parametrize("elbows", [*ELBOWS, (3, 5, 8)], ids=str)
def test_halving_the_timestep_divides_the_error_by_sixteen(elbows):
    ends = []
    for timestep in (2.5e-4, 6.25e-5, 1.5625e-5):
        sim = Simulator("paper", elbows, timestep=timestep)
        voltage = started(sim, 1).uniform(-24.0, 24.0, 10)
        sim.step(voltage, round(0.1 / timestep))
        ends.append(np.concatenate([sim.q[0], sim.q_dot[0], sim.current[0]]))
    coarse, fine = (np.linalg.norm(end - ends[-1]) for end in ends[:-1])
    # Two halvings; the finest run stands in for the exact one.
    assert 3.5 < np.log2(coarse / fine) / 2.0 < 4.6


@pytest.mark.parametrize(("n_joints", "elbows"), [(5, ()), (6, (4, 6))])
def test_runs_converge_to_the_papers_equations_integrated_elsewhere(n_joints, elbows):
    arm = shortened(uneven_arm(), n_joints)
    start = Simulator(arm, elbows).on_table(arm.nominal_pose)[0]
    voltage = np.random.default_rng(3).uniform(-12.0, 12.0, n_joints)

    def rates(_, state):
        q, q_dot, current = state.reshape(3, n_joints)
        found = dynamics.forward_dynamics(arm, q, q_dot, current, voltage, elbows)
        return np.concatenate([q_dot, found.q_ddot, found.current_dot])

    first = np.concatenate([start, np.zeros(2 * n_joints)])
    exact = solve_ivp(rates, (0.0, 0.02), first, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    for timestep, pose_error, rate_error in ((2e-3, 2e-5, 1e-3), (1e-3, 2e-7, 5e-5), (1e-4, 1e-11, 1e-8)):
        sim = Simulator(arm, elbows, timestep=timestep)
        sim.reset(start)
        sim.step(voltage, round(0.02 / timestep))
        np.testing.assert_allclose(sim.q[0], exact[:n_joints], rtol=0.0, atol=pose_error)
        rates_found = np.concatenate([sim.q_dot[0], sim.current[0]])
        np.testing.assert_allclose(rates_found, exact[n_joints:], rtol=0.0, atol=rate_error)


@pytest.mark.parametrize("elbows", [1, 2, (3, 5), (5,), (4, 7, 9)], ids=str)
def test_elbows_stay_on_the_table_through_half_a_minute_of_full_voltage(elbows):
    sim = Simulator("paper", elbows, timestep=0.002)
    rng = started(sim)
    for _ in range(600):
        sim.step(24.0 * rng.choice([-1.0, 1.0], 10), 25)
        assert sim.valid.all()
        assert np.abs(kinematics.elbow_heights(sim.arm, sim.q, sim.elbows)).max() <= 1e-12
        rise = kinematics.constraint_jacobian(sim.arm, sim.q[0], sim.elbows) @ sim.q_dot[0]
        assert np.abs(rise).max() <= 1e-5
    assert sim.time[0] == pytest.approx(30.0)
    assert np.abs(sim.q).max() > 2.0 * np.pi

"""Energy in a run: what the motors draw is stored or lost, rigid elbows do no work, and nothing else conserves it."""

from dataclasses import replace

import numpy as np
import pytest

from elbow_gym import Conditions, MotorParameters, Simulator, paper_arm
from tests.support.arms import ELBOWS, inductor_energy, mechanical_energy, started, uneven_arm


def rotor_energy(sim):
    return sim.arm.of_motors("reflected_inertia") * sim.q_dot[0] ** 2 / 2.0


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
        # Of a supply that gives next to nothing, such motors do not speed up without end.
        sim = Simulator(arm, elbows, conditions=Conditions(supply_voltage=1e-12), timestep=2e-4)
        started(sim)
        before, height = mechanical_energy(sim), sim.hand_position[0, 2]
        sim.step(np.zeros(10), 2000)
        assert mechanical_energy(sim) == pytest.approx(before, rel=1e-7)
        assert abs(sim.hand_position[0, 2] - height) > 0.1
        assert not sim.friction_loss.any()

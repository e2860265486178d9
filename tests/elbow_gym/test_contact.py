"""The table pushes and never pulls, holds at the analytic depth, and what it takes it stores or turns into heat."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from scipy.integrate import solve_ivp

from elbow_gym import (
    TableParameters,
    contact,
    dynamics,
    kinematics,
    motors,
)
from tests.support.arms import lying, small_arm
from tests.support.strategies import between, cases

NUDGE = 1e-6
ROUGH = TableParameters(stiffness=2e3, dissipation=0.8, friction=0.6, friction_velocity=0.02)


def point_velocities(arm, q, q_dot):
    """World velocities (n - 1, 3) of joints 3..n and the hand, by central differences."""
    ahead, behind = (kinematics.joint_positions(arm, q + step * q_dot)[2:] for step in (NUDGE, -NUDGE))
    return (ahead - behind) / (2.0 * NUDGE)


def world_forces(q, force):
    outward = np.array([np.cos(q[0]), np.sin(q[0]), 0.0])
    around = np.array([-np.sin(q[0]), np.cos(q[0]), 0.0])
    return force @ np.stack([outward, around, [0.0, 0.0, 1.0]])


@given(cases())
def test_the_table_never_pulls_and_leaves_alone_what_is_above_it(case):
    force = contact.contact_forces(case.arm, ROUGH, case.q, case.q_dot)
    heights = kinematics.joint_positions(case.arm, case.q)[2:, 2]
    assert force.shape == (case.arm.n_joints - 1, 3)
    assert (force[:, 2] >= 0.0).all()
    assert not force[heights >= 0.0].any()
    # Friction stays within the cone.
    assert (np.hypot(force[:, 0], force[:, 1]) <= ROUGH.friction * force[:, 2] * (1.0 + 1e-15)).all()


def test_a_pressed_point_feels_hunt_and_crossleys_force_and_coulombs_friction():
    arm, table = small_arm(), TableParameters(friction=0.5)
    q = lying(arm, 0.0, -0.001)
    q_dot = np.linalg.pinv(kinematics.constraint_jacobian(arm, q, [3, 4])) @ [0.0, -0.2]
    q_dot[0] = 2.0
    radial, tangential, normal = contact.contact_forces(arm, table, q, q_dot)[1]
    # k delta (1 + c delta_dot) = 2e4 * 0.001 * (1 + 0.5 * 0.2); the hand slides around at 2 rho = 1.6 m/s.
    assert normal == pytest.approx(22.0, rel=1e-9)
    assert tangential == pytest.approx(-11.0, rel=1e-3)
    assert abs(radial) < 1.0


def test_a_point_that_leaves_faster_than_the_table_recovers_is_free():
    arm, q = small_arm(), lying(small_arm(), 0.0, -0.001)
    fast = np.linalg.pinv(kinematics.constraint_jacobian(arm, q, [3, 4])) @ [0.0, 2.5]
    assert not contact.contact_forces(arm, TableParameters(friction=0.5), q, fast).any()


@pytest.mark.parametrize("stiffness", [1e4, 1e5])
def test_an_arm_at_rest_lies_at_the_depth_that_carries_its_weight(stiffness):
    arm, table = small_arm(), TableParameters(stiffness=stiffness, friction=0.3)
    # Joint 3 carries half of both links, the hand half of the last one; the base carries the rest.
    loads = np.array([(0.4 + 0.2) * 9.81 / 2.0, 0.2 * 9.81 / 2.0])
    q, rest = lying(arm, *(-loads / stiffness)), np.zeros(3)
    force = contact.contact_forces(arm, table, q, rest)
    np.testing.assert_allclose(force[:, 2], loads, rtol=1e-9)
    assert not force[:, :2].any()
    q_ddot = dynamics.forward_dynamics(arm, q, rest, rest, rest, table=table).q_ddot
    np.testing.assert_allclose(q_ddot, 0.0, atol=1e-8)


@given(cases())
def test_what_the_table_takes_it_stores_or_turns_into_heat(case):
    arm, q, q_dot = case.arm, case.q, case.q_dot
    heights = kinematics.joint_positions(arm, q)[2:, 2]
    # The nudges below must not carry a point through the surface.
    speeds = np.abs(point_velocities(arm, q, q_dot)[:, 2])
    assume((np.abs(heights) > 1e-4 + 2.0 * NUDGE * speeds).all())
    force, loss = (function(arm, ROUGH, q, q_dot) for function in (contact.contact_forces, contact.contact_loss))
    stored = [contact.contact_energy(arm, ROUGH, q + step * q_dot) for step in (NUDGE, -NUDGE)]
    given_up = -(world_forces(q, force) * point_velocities(arm, q, q_dot)).sum(axis=1)
    scale = 1.0 + np.max(stored) + np.abs(force).max() * (1.0 + np.abs(q_dot).sum() ** 2)
    np.testing.assert_allclose(given_up, (stored[0] - stored[1]) / (2.0 * NUDGE) + loss, rtol=0.0, atol=1e-7 * scale)
    assert (loss >= 0.0).all()


@given(cases())
def test_generalised_torque_does_the_contact_forces_work(case):
    arm, q, q_dot = case.arm, case.q, case.q_dot
    force = contact.contact_forces(arm, ROUGH, q, q_dot)
    power = (world_forces(q, force) * point_velocities(arm, q, q_dot)).sum()
    scale = 1.0 + np.abs(force).sum() * (1.0 + np.abs(q_dot).sum())
    assert contact.contact_torque(arm, q, force) @ q_dot == pytest.approx(power, rel=0.0, abs=1e-7 * scale)


@given(cases())
def test_friction_on_the_table_never_adds_power(case):
    force = contact.contact_forces(case.arm, ROUGH, case.q, case.q_dot)
    force[:, 2] = 0.0
    assert contact.contact_torque(case.arm, case.q, force) @ case.q_dot <= 1e-12 * np.abs(force).sum()


def test_the_table_enters_as_its_generalised_torque_alone():
    arm, rng = small_arm(), np.random.default_rng(4)
    q, q_dot, current, voltage = np.array([0.3, 1.7, 0.4]), *rng.normal(size=(3, 3))
    on, off = (dynamics.forward_dynamics(arm, q, q_dot, current, voltage, (), table=table) for table in (ROUGH, None))
    torque = contact.contact_torque(arm, q, contact.contact_forces(arm, ROUGH, q, q_dot))
    assert np.abs(torque).max() > 1.0
    np.testing.assert_allclose(dynamics.mass_matrix(arm, q) @ (on.q_ddot - off.q_ddot), torque, rtol=1e-10)
    np.testing.assert_array_equal(on.current_dot, off.current_dot)


def bounce(arm, table, until=0.03):
    """Throws the small arm, turning, onto the table: rows of q, q_dot, current and the losses [J] so far."""
    start = np.array([0.0, *lying(arm, 0.002, 0.003)[1:], 2.0, 0.6, 0.2, 0.0, 0.0, 0.0])

    def rates(_, state):
        q, q_dot, current = state[:9].reshape(3, 3)
        found = dynamics.forward_dynamics(arm, q, q_dot, current, np.zeros(3), table=table)
        friction = np.array(arm.joint_viscous_friction) + arm.of_motors("reflected_viscous_friction")
        lost = (
            (friction * q_dot**2).sum() - motors.coulomb_friction(arm, q_dot) @ q_dot,
            contact.contact_loss(arm, table, q, q_dot).sum(),
            (1.1 * current**2).sum(),
        )
        return np.concatenate([q_dot, found.q_ddot, found.current_dot, lost])

    first = np.concatenate([start, np.zeros(3)])
    return solve_ivp(rates, (0.0, until), first, method="DOP853", rtol=1e-8, atol=1e-10).y.T


def stored_energy(arm, table, state):
    q, q_dot, current = state[:9].reshape(3, 3)
    z = kinematics.joint_positions(arm, q)[:, 2]
    return (
        q_dot @ dynamics.mass_matrix(arm, q) @ q_dot / 2.0
        + arm.gravity * arm.of_links("mass") @ (z[1:] + z[:-1]) / 2.0
        + arm.of_motors("armature_inductance") @ current**2 / 2.0
        + contact.contact_energy(arm, table, q).sum()
    )


@pytest.mark.slow
def test_a_bounce_conserves_energy_but_for_what_friction_contact_and_copper_take():
    arm = small_arm(gear_coulomb_friction=0.002, gear_viscous_friction=1e-4, torque_constant=0.02, rotor_inertia=1e-6)
    table = TableParameters(stiffness=2e4, dissipation=0.5, friction=0.3)
    run = bounce(arm, table)
    energies = np.array([stored_energy(arm, table, state) for state in run])
    heights = np.array([kinematics.joint_positions(arm, state[:3])[2:, 2] for state in run])
    # It hits, with both points, and comes off again.
    assert (heights.min(axis=0) < -1e-4).all()
    assert heights[heights[:, 1].argmin() :, 1].max() > 1e-3
    friction, touching, copper = run[-1, 9:]
    assert min(friction, touching, copper) > 1e-4
    np.testing.assert_allclose(energies + run[:, 9:].sum(axis=1), energies[0], rtol=0.0, atol=1e-7)
    assert (np.diff(run[:, 10]) >= -1e-12).all()


@pytest.mark.slow
def test_an_elastic_smooth_table_gives_back_all_it_took():
    arm = replace(small_arm(gear_viscous_friction=0.0, torque_constant=1e-9), joint_viscous_friction=(0.0,) * 3)
    table = TableParameters(stiffness=2e4, dissipation=0.0)
    run = bounce(arm, table, until=0.02)
    energies = np.array([stored_energy(arm, table, state) for state in run])
    np.testing.assert_allclose(energies, energies[0], rtol=0.0, atol=1e-7)
    taken = np.array([contact.contact_energy(arm, table, state[:3]).sum() for state in run])
    assert taken.max() > 0.01
    assert taken[-1] == 0.0
    assert not run[:, 10].any()


@pytest.mark.slow
@given(cases(largest=8), between(0.0, 0.3))
def test_rubbing_elbows_stay_on_their_plane_and_only_brake(case, friction):
    arm, q, q_dot, current, voltage, elbows = case
    jacobian = kinematics.constraint_jacobian(arm, q, elbows)
    compliance = jacobian @ np.linalg.solve(dynamics.mass_matrix(arm, q), jacobian.T)
    assume(len(elbows) > 0 and np.linalg.cond(compliance) < 1e4 and np.diag(compliance).min() > 1e-3)
    found = dynamics.forward_dynamics(arm, q, q_dot, current, voltage, elbows, elbow_friction=friction)
    kept = jacobian @ found.q_ddot + kinematics.constraint_bias(arm, q, q_dot, elbows)
    np.testing.assert_allclose(kept, 0.0, atol=1e-9 * (1.0 + np.abs(found.q_ddot).max()))
    rubbing = contact.elbow_friction_force(arm, q, q_dot, elbows, found.elbow_force, friction)
    sliding = contact.sliding_velocity(arm, q, q_dot, elbows)
    assert ((rubbing * sliding).sum(axis=1) <= 0.0).all()
    assert not rubbing[found.elbow_force <= 0.0].any()


def sliding_start(arm):
    """The paper's pose with both elbows sliding along the table at about 1 m/s."""
    jacobian = kinematics.constraint_jacobian(arm, arm.nominal_pose, (4, 7))
    wish = np.array([1.5, 0.5, -1.0, 1.0, 0.3, -0.8, 0.2, 0.0, 0.0, 0.0])
    return np.array(arm.nominal_pose), wish - np.linalg.pinv(jacobian) @ jacobian @ wish


def newton_residual(arm, q, q_dot, current, found, friction_force):
    """What is missing in M q_ddot + B = K_m i + J_c^T f_n + J_t^T f_t [N m], J by finite differences of positions."""
    steps = NUDGE * np.eye(10)
    elbows = kinematics.joint_positions(arm, np.concatenate([q + steps, q - steps]))[:, [3, 6]]
    jacobians = (elbows[:10] - elbows[10:]) / (2.0 * NUDGE)
    force = world_forces(q, np.column_stack([friction_force, found.elbow_force]))
    given = arm.of_motors("joint_torque_constant") * current + np.einsum("jpx,px->j", jacobians, force)
    return given - dynamics.mass_matrix(arm, q) @ found.q_ddot - dynamics.bias_forces(arm, q, q_dot)


def test_a_sliding_elbow_that_pushes_drags_with_mu_times_its_force(arm):
    (q, q_dot), still = sliding_start(arm), np.zeros(10)
    found = dynamics.forward_dynamics(arm, q, q_dot, still, still, (4, 7), elbow_friction=0.2)
    assert (found.elbow_force > 0.1).all()
    rubbing = contact.elbow_friction_force(arm, q, q_dot, (4, 7), found.elbow_force, 0.2)
    sliding = contact.sliding_velocity(arm, q, q_dot, (4, 7))
    speed = np.linalg.norm(sliding, axis=1)
    assert (speed > 0.3).all()
    # Against the sliding, and short of mu f_n by v_s^2 / (2 v^2) at most.
    np.testing.assert_allclose(rubbing, -0.2 * found.elbow_force[:, None] * sliding / speed[:, None], rtol=6e-4)
    residual = newton_residual(arm, q, q_dot, still, found, rubbing)
    np.testing.assert_allclose(residual, 0.0, atol=1e-8)


def test_a_pulling_elbow_rubs_no_more_than_a_smooth_one(arm):
    q, q_dot = sliding_start(arm)
    current = np.zeros(10)
    # Joint 2 lifts joint 4, joint 5 presses joint 7 down.
    current[[1, 4]] = -40.0, 10.0
    found = dynamics.forward_dynamics(arm, q, q_dot, current, np.zeros(10), (4, 7), elbow_friction=0.2)
    assert found.elbow_force[0] < -1.0
    assert found.elbow_force[1] > 1.0
    rubbing = contact.elbow_friction_force(arm, q, q_dot, (4, 7), found.elbow_force, 0.2)
    assert not rubbing[0].any()
    assert np.linalg.norm(rubbing[1]) == pytest.approx(0.2 * found.elbow_force[1], rel=1e-3)
    np.testing.assert_allclose(newton_residual(arm, q, q_dot, current, found, rubbing), 0.0, atol=1e-7)


def test_negative_elbow_friction_is_refused(arm):
    still = np.zeros(10)
    with pytest.raises(ValueError, match=r"^elbow_friction must not be negative, got -0\.1$"):
        dynamics.forward_dynamics(arm, still, still, still, still, elbow_friction=-0.1)

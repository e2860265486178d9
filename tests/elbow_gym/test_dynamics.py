"""The paper's form against Pinocchio's vectors, against Lagrange, and against textbook cases."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from elbow_gym import ArmParameters, LinkParameters, MotorParameters, dynamics, kinematics
from tests.support.strategies import cases

VECTORS = np.load(Path(__file__).parents[1] / "vectors" / "forward_dynamics_vectors.npz")
ELBOWS = {0: (), 1: (4,), 2: (4, 7)}
NUDGE = 1e-5


def assert_close(value, expected, relative=1e-10):
    """Equal to a share of the expected array's largest entry."""
    np.testing.assert_allclose(value, expected, rtol=0.0, atol=relative * np.abs(expected).max(initial=0.0))


def without_friction(arm):
    motors = tuple(replace(motor, gear_viscous_friction=0.0) for motor in arm.motors)
    return replace(arm, motors=motors, joint_viscous_friction=(0.0,) * arm.n_joints)


def rate_of_mass_matrix(arm, q, direction):
    """Derivative of M along a direction in q, by central differences."""
    ahead, behind = (dynamics.mass_matrix(arm, q + step * direction) for step in (NUDGE, -NUDGE))
    return (ahead - behind) / (2.0 * NUDGE)


def centres_of_mass(arm, q):
    """World positions of the links' middles (n, 3), for complex q too."""
    length = arm.of_links("length")
    phi = np.concatenate([[0.0], np.cumsum(q[1:])])
    rho = np.cumsum(length * np.sin(phi)) - length * np.sin(phi) / 2.0
    z = np.cumsum(length * np.cos(phi)) - length * np.cos(phi) / 2.0
    return np.stack([rho * np.cos(q[0]), rho * np.sin(q[0]), z], axis=1)


def lagrangian_matrix_and_gravity(arm, q):
    """M_J from the links' kinetic energies and G from the potential energy's gradient, by complex steps."""
    n = arm.n_joints
    slopes = np.stack([centres_of_mass(arm, q + 1e-30j * unit).imag / 1e-30 for unit in np.eye(n)], axis=-1)
    matrix = np.diag(arm.of_motors("reflected_inertia"))
    spins = np.zeros((3, n))
    for k, link in enumerate(arm.links):
        spins[:, k] = [-np.sin(q[0]), np.cos(q[0]), 0.0] if k else [0.0, 0.0, 1.0]
        phi = q[1 : k + 1].sum()
        axis = np.array([np.sin(phi) * np.cos(q[0]), np.sin(phi) * np.sin(q[0]), np.cos(phi)])
        across = link.mass * (3.0 * link.radius**2 + link.length**2) / 12.0
        along = link.mass * link.radius**2 / 2.0
        inertia = across * np.eye(3) + (along - across) * np.outer(axis, axis)
        matrix = matrix + link.mass * slopes[k].T @ slopes[k] + spins.T @ inertia @ spins
    return matrix, arm.gravity * arm.of_links("mass") @ slopes[:, 2]


@pytest.mark.parametrize("sample", range(0, 60, 2))
def test_matrix_bias_and_constraints_are_pinocchios(arm, sample):
    expected = {name: VECTORS[name][sample] for name in VECTORS if len(VECTORS[name]) == 60}
    q, q_dot = expected["q"], expected["qd"]
    assert_close(dynamics.mass_matrix(arm, q), expected["M"])
    assert_close(dynamics.bias_forces(arm, q, q_dot), expected["bias"])
    assert_close(dynamics.bias_forces(arm, q, np.zeros(10)), expected["G"])
    assert_close(dynamics.bias_forces(without_friction(arm), q, q_dot), expected["H"] + expected["G"])
    assert_close(dynamics.constraint_jacobian(arm, q, (4, 7)), expected["Jc"])
    assert_close(dynamics.constraint_bias(arm, q, q_dot, (4, 7)), expected["Jdot_qd"])
    assert_close(kinematics.joint_positions(arm, q)[[3, 6]], expected["elbow_pos"])
    assert_close(kinematics.hand_position(arm, q), expected["hand_pos"])


@pytest.mark.parametrize("elbows", [0, 1, 2])
def test_accelerations_and_elbow_forces_are_pinocchios(arm, elbows):
    for sample in range(elbows, 60, 3):
        state = (VECTORS[name][sample] for name in ("q", "qd", "i", "v"))
        q_ddot, force, current_dot = dynamics.forward_dynamics(arm, *state, ELBOWS[elbows])
        assert_close(q_ddot, VECTORS[f"qdd_e{elbows}"][sample])
        assert_close(force, VECTORS[f"fn_e{elbows}"][sample])
        assert_close(current_dot, VECTORS[f"idot_e{elbows}"][sample])


@pytest.mark.parametrize(("elbows", "forces"), [(1, [2.16304021]), (2, [2.39830698, 2.72709652])])
def test_the_table_carries_the_start_pose_with_the_settled_forces(arm, elbows, forces):
    rest = np.zeros(10)
    q_ddot, force, _ = dynamics.forward_dynamics(arm, arm.nominal_pose, rest, rest, rest, ELBOWS[elbows])
    np.testing.assert_allclose(force, forces, rtol=0.0, atol=1e-8)
    assert_close(q_ddot, VECTORS[f"qdd_q0_e{elbows}"])


@given(cases(largest=7))
def test_newton_euler_equals_the_lagrangian(case):
    arm, q, q_dot = without_friction(case.arm), case.q, case.q_dot
    matrix, gravity = lagrangian_matrix_and_gravity(arm, q)
    assert_close(dynamics.mass_matrix(arm, q), matrix, 1e-13)
    slopes = [
        (lagrangian_matrix_and_gravity(arm, q + step)[0] - lagrangian_matrix_and_gravity(arm, q - step)[0])
        / (2.0 * NUDGE)
        for step in NUDGE * np.eye(arm.n_joints)
    ]
    along = np.einsum("kij,k,j->i", slopes, q_dot, q_dot)
    across = np.einsum("kij,i,j->k", slopes, q_dot, q_dot)
    scale = np.abs(matrix).max() * (1.0 + q_dot @ q_dot) + np.abs(gravity).max()
    bias = dynamics.bias_forces(arm, q, q_dot)
    np.testing.assert_allclose(bias, along - across / 2.0 + gravity, rtol=0.0, atol=1e-9 * scale)


@given(cases(largest=7))
def test_inverse_dynamics_is_affine_in_the_acceleration(case):
    arm, q, q_dot, q_ddot = case.arm, case.q, case.q_dot, case.current
    expected = dynamics.mass_matrix(arm, q) @ q_ddot + dynamics.bias_forces(arm, q, q_dot)
    assert_close(dynamics.inverse_dynamics(arm, q, q_dot, q_ddot), expected, 1e-12)


@given(cases())
@settings(max_examples=30)
def test_mass_matrix_is_symmetric_positive_definite(case):
    matrix = dynamics.mass_matrix(case.arm, case.q)
    assert_close(matrix, matrix.T, 1e-14)
    assert np.linalg.eigvalsh(matrix).min() > 0.0


@given(cases(largest=7))
def test_velocity_products_do_no_work_beyond_the_changing_inertia(case):
    arm, q, q_dot = replace(without_friction(case.arm), gravity=0.0), case.q, case.q_dot
    # q_dot^T (M_dot - 2 C) q_dot = 0 with C q_dot = H.
    doubled = 2.0 * q_dot @ dynamics.bias_forces(arm, q, q_dot)
    scale = np.abs(dynamics.mass_matrix(arm, q)).max() * (1.0 + np.abs(q_dot).sum()) ** 3
    assert q_dot @ rate_of_mass_matrix(arm, q, q_dot) @ q_dot == pytest.approx(doubled, rel=0.0, abs=1e-9 * scale)


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 2.0, 2.5])
def test_one_pitching_link_is_the_compound_pendulum(angle):
    rod, dust = LinkParameters(mass=0.8, length=0.5, radius=0.02), LinkParameters(mass=1e-12, length=1e-6, radius=1e-6)
    motor = MotorParameters(rotor_inertia=1e-4, gear_ratio=2.0, gear_viscous_friction=0.0)
    arm = ArmParameters(
        links=(replace(dust, length=0.0), rod, dust),
        motors=(motor, motor, replace(motor, rotor_inertia=1e-12)),
        joint_viscous_friction=(0.0,) * 3,
        nominal_pose=(0.0,) * 3,
    )
    q_ddot = dynamics.forward_dynamics(arm, [0.4, angle, 0.0], *np.zeros((3, 3)))[0]
    # About its end: m l^2 / 3 + m r^2 / 4, and the rotor's k^2 I_m; upright is the unstable equilibrium.
    inertia = 0.8 * 0.25 / 3.0 + 0.8 * 0.0004 / 4.0 + 4e-4
    assert q_ddot[1] == pytest.approx(0.8 * 9.81 * 0.25 * np.sin(angle) / inertia, rel=1e-8)


def test_a_straight_arm_pitches_like_one_rod(arm):
    q, unit = np.array([0.0, 0.7] + [0.0] * 8), np.eye(10)[1]
    torque = dynamics.inverse_dynamics(arm, q, np.zeros(10), 2.0 * unit)[1]
    # Nine links of 0.1 kg and 0.3 m: m L^2 / 3 + m r^2 / 4 about the end, and the rotor.
    inertia = 0.9 * 2.7**2 / 3.0 + 0.9 * 1e-4 / 4.0 + 0.001476
    assert torque == pytest.approx(2.0 * inertia - 0.9 * 9.81 * 1.35 * np.sin(0.7), rel=1e-13)


def test_a_stalled_motor_draws_v_over_r_and_a_free_one_turns_at_v_over_k(arm):
    volts, still = np.full(10, 24.0), np.zeros(10)
    stalled = dynamics.forward_dynamics(arm, still, still, volts / 1.1, volts)
    np.testing.assert_allclose(stalled.current_dot, 0.0, atol=1e-11)
    np.testing.assert_allclose(dynamics.motor_torque(arm, still, still, volts / 1.1), 0.609 * 24.0 / 1.1, rtol=1e-14)
    free = np.full(10, 24.0 / 0.609)
    np.testing.assert_allclose(dynamics.back_emf(arm, free), volts, rtol=1e-14)
    np.testing.assert_allclose(dynamics.forward_dynamics(arm, still, free, still, volts).current_dot, 0.0, atol=1e-11)
    # Without current the gear's friction and the rotor's inertia are all it passes on.
    np.testing.assert_allclose(
        dynamics.motor_torque(arm, free, volts, still), -0.09 * free - 0.001476 * volts, rtol=1e-14
    )


def test_elbows_that_cannot_be_told_apart_are_an_error(arm):
    upright = np.zeros(10)
    with pytest.raises(np.linalg.LinAlgError):
        dynamics.forward_dynamics(arm, upright, upright, upright, upright, (4,))

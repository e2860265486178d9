"""The motion asked for is the motion that the kernel makes of the computed currents and voltages."""

import numpy as np
import pytest
from hypothesis import given

from agents.control.inverse_dynamics import InverseDynamics
from elbow_gym import Simulator, dynamics, kinematics
from tests.support.comparisons import assert_close
from tests.support.kernel_calls import accelerations_of
from tests.support.payloads import with_speck
from tests.support.strategies import between, cases

ELBOWS = [(), (4,), (4, 7)]


def motion(arm, elbows, seed):
    """A pose on the table, rates and accelerations that keep the elbows there, and rates of current."""
    rng = np.random.default_rng(seed)
    q = Simulator(arm, elbows).on_table(arm.nominal_pose + rng.normal(scale=0.2, size=arm.n_joints))[0]
    jacobian = kinematics.constraint_jacobian(arm, q, elbows)
    q_dot = rng.normal(size=arm.n_joints)
    q_dot -= np.linalg.pinv(jacobian) @ (jacobian @ q_dot)
    q_ddot = rng.normal(scale=5.0, size=arm.n_joints)
    bias = kinematics.constraint_bias(arm, q, q_dot, elbows)
    q_ddot -= np.linalg.pinv(jacobian) @ (jacobian @ q_ddot + bias)
    return q, q_dot, q_ddot, rng.normal(scale=50.0, size=arm.n_joints)


@given(cases())
def test_torque_equals_the_papers_newton_euler_pass(case):
    q_ddot = case.current - case.voltage
    expected = dynamics.inverse_dynamics(case.arm, case.q, case.q_dot, q_ddot)
    assert_close(InverseDynamics(case.arm).torque(case.q, case.q_dot, q_ddot), expected, 1e-12)


@given(cases(), between(0.01, 5.0))
def test_payload_needs_the_torque_of_a_last_link_of_no_size_that_never_turns(case, payload):
    q_ddot = case.current - case.voltage
    arm = with_speck(case.arm, payload)
    locked = ([*values, 0.0] for values in (case.q, case.q_dot, q_ddot))
    expected = dynamics.inverse_dynamics(arm, *locked)[:-1]
    inverse = InverseDynamics(case.arm, payload=payload)
    assert_close(inverse.torque(case.q, case.q_dot, q_ddot), expected, 1e-11)
    assert_close(inverse.holding_torque(case.q), inverse.torque(case.q, 0.0 * case.q, 0.0 * case.q), 1e-12)


@pytest.mark.parametrize("elbows", ELBOWS)
@pytest.mark.parametrize("seed", range(5))
def test_kernel_under_the_computed_voltage_has_the_asked_acceleration(arm, elbows, seed):
    q, q_dot, q_ddot, current_dot = motion(arm, elbows, seed)
    payload = 0.1 * seed
    inverse = InverseDynamics(arm, elbows, payload)
    current, elbow_force = inverse.drive(q, q_dot, q_ddot)
    voltage = inverse.voltage(q_dot, current, current_dot)
    case = type("Case", (), {})()
    case.arm, case.q, case.q_dot, case.current, case.voltage, case.elbows = arm, q, q_dot, current, voltage, elbows
    reached, force, rate = accelerations_of(case, payload)
    np.testing.assert_allclose(reached, q_ddot, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(force, elbow_force, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(rate, current_dot, rtol=0.0, atol=1e-8)

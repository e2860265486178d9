"""The compiled recursion equals the paper's equations, derived another way, on any arm of the family."""

import numpy as np
import pytest
from hypothesis import given, settings

from elbow_gym import dynamics
from tests.support.comparisons import assert_close, assume_solvable
from tests.support.kernel_calls import accelerations_of
from tests.support.payloads import with_speck
from tests.support.strategies import between, cases


def assert_equal_to_the_papers_form(case):
    arm, q, q_dot, current, voltage, elbows = case
    assume_solvable(dynamics.mass_matrix(arm, q), dynamics.constraint_jacobian(arm, q, elbows))
    expected = dynamics.forward_dynamics(arm, q, q_dot, current, voltage, elbows)
    for value, reference, tolerance in zip(accelerations_of(case), expected, (1e-10, 1e-10, 1e-13), strict=True):
        assert_close(value, reference, tolerance)


@given(cases())
@settings(max_examples=100)
def test_fast_form_equals_the_papers_form(case):
    assert_equal_to_the_papers_form(case)


@pytest.mark.soak
@given(cases())
@settings(max_examples=2000)
def test_fast_form_equals_the_papers_form_for_thousands_of_arms(case):
    assert_equal_to_the_papers_form(case)


@given(cases(largest=8), between(0.01, 5.0))
def test_a_payload_is_a_last_link_of_no_size_that_never_turns(case, payload):
    _, q, q_dot, current, _, elbows = case
    n, p = case.arm.n_joints, len(elbows)
    arm = with_speck(case.arm, payload)
    # Its joint stays locked: the first n equations are those of the arm that carries it.
    matrix = dynamics.mass_matrix(arm, [*q, 0.0])[:n, :n]
    bias = dynamics.bias_forces(arm, [*q, 0.0], [*q_dot, 0.0])[:n]
    jacobian = dynamics.constraint_jacobian(case.arm, q, elbows)
    assume_solvable(matrix, jacobian)
    system = np.block([[matrix, -jacobian.T], [jacobian, np.zeros((p, p))]])
    torque = case.arm.of_motors("joint_torque_constant") * current - bias
    drift = dynamics.constraint_bias(case.arm, q, q_dot, elbows)
    expected = np.linalg.solve(system, np.concatenate([torque, -drift]))
    q_ddot, force, _ = accelerations_of(case, payload)
    assert_close(q_ddot, expected[:n], 1e-9)
    assert_close(force, expected[n:], 1e-9)

"""Terminal cost: what an arm at rest costs in the simulator, and CasADi's form of it."""

import numpy as np
import pytest

from agents.control.inverse_dynamics import InverseDynamics
from agents.planning.tail import SPEED, Tail
from elbow_gym import Simulator, paper_arm
from elbow_gym.kinematics import hand_position, on_table

ELBOWS = {0: (), 1: (4,), 2: (4, 7)}


def pose(elbows, seed=0):
    arm = paper_arm()
    return on_table(arm, np.array(arm.nominal_pose) + 0.1 * np.random.default_rng(seed).normal(size=10), elbows)


@pytest.mark.parametrize("count", ELBOWS)
def test_resting_pays_what_holding_the_pose_draws_from_the_supply(count):
    elbows, period = ELBOWS[count], 0.02
    inverse, q = InverseDynamics(paper_arm(), elbows), pose(elbows)
    current = inverse.hold(q).current
    simulator = Simulator(paper_arm(), elbows, 1, timestep=0.001)
    simulator.reset(q, current=current)
    simulator.step(inverse.resistance * current, 20)
    np.testing.assert_allclose(simulator.q[0], q, rtol=0.0, atol=1e-9)
    tail, hand = Tail(inverse, period, 5 * period, 0.1), hand_position(paper_arm(), q)
    off = np.array([0.03, 0.0, 0.04])
    found = tail.cost(q, np.zeros(10), hand + off, np.zeros(3), 2.0, 0.001)
    power = simulator.electrical_energy.sum() / period
    assert found == pytest.approx(5.0 * (2.0 * 0.05 + 0.001 * power), rel=1e-6)


def test_a_hand_that_keeps_up_with_the_target_is_on_it():
    inverse = InverseDynamics(paper_arm(), ())
    tail, q, q_dot = Tail(inverse, 0.02, 0.5, 1e-4), pose(()), np.random.default_rng(1).normal(size=10)
    hand, step = hand_position(paper_arm(), q), 1e-6
    velocity = (hand_position(paper_arm(), q + step * q_dot) - hand) / step
    thrown = SPEED * (q_dot**2).sum()
    assert tail.cost(q, q_dot, hand, velocity, 1.0, 0.0) - thrown < 1e-5
    assert tail.cost(q, q_dot, hand, 0.0 * velocity, 1.0, 0.0) - thrown > 1e-3


@pytest.mark.parametrize("count", ELBOWS)
def test_the_programs_form_is_the_same_cost_and_its_derivatives_are_its_own(count):
    ca = pytest.importorskip("casadi")
    inverse, rng = InverseDynamics(paper_arm(), ELBOWS[count], 0.2), np.random.default_rng(2)
    tail, size = Tail(inverse, 0.02, 0.5, 0.05), 42
    written = tail.written(size)
    z = np.concatenate([pose(ELBOWS[count]), rng.normal(size=size - 10)])
    target, velocity = rng.normal(size=3), rng.normal(size=3)
    rest = (target, velocity, 0.0, 1.5, 0.002, 0.2)
    expected = tail.cost(z[:10], z[10:20], target, velocity, 1.5, 0.002)
    assert float(written.cost(z, *rest)) == pytest.approx(float(expected), rel=1e-12)
    along, step = rng.normal(size=size), 1e-6
    values = [float(written.cost(z + sign * step * along, *rest)) for sign in (1, -1)]
    assert float(ca.dot(written.slope(z, *rest), along)) == pytest.approx(
        (values[0] - values[1]) / (2 * step), rel=1e-5
    )
    slopes = [np.array(written.slope(z + sign * step * along, *rest)).ravel() for sign in (1, -1)]
    upper = ca.DM(written.hessian_sparsity, written.hessian(z, *rest))
    turned = np.array(ca.mtimes(ca.triu2symm(upper), along)).ravel()
    np.testing.assert_allclose(turned, (slopes[0] - slopes[1]) / (2 * step), rtol=1e-5, atol=1e-5)

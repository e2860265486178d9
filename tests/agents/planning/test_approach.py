"""Approaches: motions that join the path, and the voltages that they need."""

import numpy as np
import pytest

from agents.control.inverse_dynamics import InverseDynamics
from agents.planning.approach import ARRIVALS, _motion, approaches
from agents.planning.planner import View
from elbow_gym import paper_arm
from elbow_gym.kinematics import hand_position, inverse_kinematics, on_table

PERIOD = 0.02


def still(inverse, q, hand, velocity=(0.0, 0.0, 0.0)):
    """A view of an arm at rest and a target that stays where it is."""
    state = {"q": q, "q_dot": np.zeros(10), "current": np.zeros(10)}
    return View(state, 0.0, np.tile(hand, (50, 1)), np.tile(velocity, (50, 1)), inverse)


def test_an_arm_at_rest_on_a_resting_target_is_held():
    arm = paper_arm()
    inverse, base = InverseDynamics(arm, (4, 7)), on_table(arm, arm.nominal_pose, (4, 7))
    q = inverse_kinematics(arm, base, np.array([1.5, 1.5, 0.4]))[0]
    found = approaches(still(inverse, q, hand_position(arm, q)), q, 12, PERIOD)
    assert found.shape == (len(ARRIVALS), 12, 10)
    hold = inverse.resistance * inverse.hold(q).current
    np.testing.assert_allclose(found, np.broadcast_to(hold, found.shape), rtol=0.0, atol=1e-9)


def test_motion_starts_as_the_arm_moves_and_joins_the_path():
    rng, h = np.random.default_rng(0), 1e-4
    path, rate = rng.normal(size=(50, 3)), rng.normal(size=(50, 3))
    state = {"q": rng.normal(size=3), "q_dot": rng.normal(size=3)}
    q, q_dot = _motion(state, path, rate, 40, h)
    np.testing.assert_array_equal((q[0], q_dot[0]), (state["q"], state["q_dot"]))
    np.testing.assert_allclose(q[40:], path[39:], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(q_dot[40], rate[39], rtol=0.0, atol=1e-8)
    # The rates are the angles' own, to the fourth order of the period, and the first acceleration is nothing.
    slope = (q[:36] - 8.0 * q[1:37] + 8.0 * q[3:39] - q[4:40]) / (12.0 * h)
    np.testing.assert_allclose(slope, q_dot[2:38], rtol=0.0, atol=1e-4 * np.abs(q_dot).max())
    times = np.arange(5) * h
    assert np.abs(np.polyfit(times, q_dot[:5], 4)[-2] * h).max() < 1e-6 * np.abs(q_dot[:5]).max()


def test_there_is_no_approach_to_what_is_out_of_reach():
    q = np.array(paper_arm().nominal_pose)
    found = approaches(still(InverseDynamics(paper_arm()), q, np.array([9.0, 0.0, 0.4])), q, 12, PERIOD)
    assert found.shape == (0, 12, 10)


@pytest.mark.parametrize("angle", [0.0, 2.0])
def test_idle_joints_go_back_to_the_start_pose_where_the_path_is_out_of_their_reach(angle):
    arm = paper_arm()
    pose = np.array(arm.nominal_pose)
    folded = pose.copy()
    folded[2] += 1.5 + 0.1 * angle
    inverse = InverseDynamics(arm)
    view = still(inverse, folded, np.array([1.5, 1.5, 0.4]))
    with pytest.raises(ValueError, match="position must be within reach"):
        inverse_kinematics(arm, folded, view.target[0])
    voltage = approaches(view, pose, 50, PERIOD)[0]
    # Behind the arrival the arm rests in the start pose with its hand on the target.
    hold = inverse.resistance * inverse.hold(inverse_kinematics(arm, pose, view.target[0])[0]).current
    np.testing.assert_allclose(voltage[20:], np.broadcast_to(hold, (30, 10)), rtol=0.0, atol=1e-9)

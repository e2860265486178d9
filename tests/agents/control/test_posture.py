"""Slopes of the posture's search are those of the functions, and its steps stay within the bounds."""

import math

import numpy as np
import pytest

from agents.control.inverse_dynamics import InverseDynamics
from agents.control.posture import LARGEST, best_postures, leads_to, slopes
from elbow_gym import Circle, paper_arm
from elbow_gym.kinematics import elbow_heights, inverse_kinematics, on_table, pitches
from elbow_gym.task.default_circle import default_circle
from tests.support.arms import shortened, six_joint_arm


def test_slopes_are_the_derivatives_of_many_values_and_of_one():
    angles = np.array([0.3, -1.2, 2.0])
    np.testing.assert_allclose(slopes(np.sin, angles), np.diag(np.cos(angles)), atol=1e-7)
    np.testing.assert_allclose(slopes(lambda q: np.prod(q, axis=-1), angles), [-2.4, 0.6, -0.36], atol=1e-7)


def test_steps_stay_within_the_bounds_of_the_search():
    asked = []

    def function(angles):
        asked.append(angles)
        return angles.sum(axis=-1)

    np.testing.assert_allclose(slopes(function, np.array([LARGEST, -LARGEST])), [1.0, 1.0], atol=1e-7)
    assert np.abs(asked[0]).max() <= LARGEST


def test_holding_torque_carries_the_weight_of_the_links_beyond_each_joint(arm):
    rng = np.random.default_rng(0)
    q = rng.normal(size=(4, 10))
    length, mass, phi = arm.of_links("length"), arm.of_links("mass"), pitches(q)
    tip = np.cumsum(length * np.sin(phi), axis=-1)
    centre = tip - length * np.sin(phi) / 2.0
    for joint in range(2, 11):
        lever = centre[:, joint - 1 :] - tip[:, joint - 2][:, None]
        expected = -arm.gravity * (mass[joint - 1 :] * lever).sum(axis=-1)
        np.testing.assert_allclose(InverseDynamics(arm).holding_torque(q)[:, joint - 1], expected, atol=1e-12)


def test_holding_a_pose_is_driving_without_motion(arm):
    inverse = InverseDynamics(arm, (4, 7))
    q, rest = np.random.default_rng(1).normal(size=(5, 10)), np.zeros((5, 10))
    for held, driven in zip(inverse.hold(q), inverse.drive(q, rest, rest), strict=True):
        np.testing.assert_allclose(held, driven, rtol=1e-12, atol=1e-12)


def test_posture_on_the_other_side_of_an_elbow_is_not_moved_to():
    arm = six_joint_arm()
    start = on_table(arm, arm.nominal_pose, (4,))
    assert leads_to(arm, (4,), inverse_kinematics(arm, start, default_circle(arm, (4,)).position(0.0))[0])
    # Links 2 and 3 fold over their own axis: up to joint 4 and down again on the other side.
    folded = start * np.array([1.0, -1.0, -1.0, 1.0, 1.0, 1.0]) + np.array([0.0, 0.0, 2.0 * np.pi, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(elbow_heights(arm, folded, (4,)), 0.0, atol=1e-9)
    assert not leads_to(arm, (4,), folded)


@pytest.mark.slow
def test_a_posture_is_found_where_joint_n_minus_1_comes_to_half_a_turn_on_its_way():
    # Its elbow is under the middle of the circle, so that the last two links stand up from it and lean over both ways.
    arm = shortened(six_joint_arm(), 5)
    circle = default_circle(arm, (4,))
    start = on_table(arm, arm.nominal_pose, (4,))
    angle = np.linspace(0.0, 2.0 * np.pi, 9)
    turned = inverse_kinematics(arm, start, circle.position(angle))[0][:, -2]
    assert turned.min() < -LARGEST < turned.max()
    best = best_postures(arm, (4,), circle, starts=2)[0]
    np.testing.assert_allclose(elbow_heights(arm, best.pose, (4,)), 0.0, atol=1e-5)
    assert leads_to(arm, (4,), best.pose)


def test_a_search_that_ends_stretched_after_a_whole_turn_of_the_last_joint_is_left_out():
    # The search from the third start ends there, a rounding out of reach; the others find the posture.
    center = (1.4966571344652544, 1.351089504494192, 0.46597322095313176)
    radius, tilt, axis = 0.10114392536810793 / math.cos(math.pi / 8.0), 0.7199748348679174, 2.465207290768988
    circle = Circle(center=center, radius=radius, tilt=tilt, tilt_axis=axis)
    found = best_postures(paper_arm(), (4, 7), circle, starts=3, payload=0.12094408830556702)
    assert found[0].copper_loss < 50.0

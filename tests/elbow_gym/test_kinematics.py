"""Positions are the paper's, Jacobians are derivatives, and inverse kinematics undoes the forward one."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from elbow_gym import LinkParameters, Simulator, kinematics
from tests.support.arms import uneven_arm
from tests.support.strategies import between, cases

NUDGE = 1e-6
# Of a point on the paper's circle: angle along it [rad].
angles = between(0.0, 2.0 * np.pi)


def circle(angle):
    """Point and its derivative to the angle, on the paper's circle (centre 1.5, 1.5, 0.4 m, radius 0.1 m)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([1.5 + 0.1 * c, 1.5 + 0.1 * s, 0.4]), np.array([-0.1 * s, 0.1 * c, 0.0])


def test_start_pose_is_the_papers(arm):
    positions = kinematics.joint_positions(arm, arm.nominal_pose)
    assert np.abs(positions[[0, 1, 3, 6], 2]).max() < 1e-15  # joints 1, 2, 4 and 7 are at the table's height
    assert positions[-1] == pytest.approx([2.17279, 0.0, 0.42426], abs=5e-6)
    assert positions[3] == pytest.approx([0.6 / np.sqrt(2.0), 0.0, 0.0])  # two links at 45 and 135 degrees


def test_yaw_turns_the_arm_about_the_vertical(arm):
    q = np.array(arm.nominal_pose)
    q[0] = np.pi / 2.0
    x, y, z = kinematics.hand_position(arm, q)
    assert (x, y, z) == pytest.approx((0.0, 2.17279, 0.42426), abs=5e-6)


def test_straight_arm_stands_upright(arm):
    positions = kinematics.joint_positions(arm, np.zeros(10))
    assert positions[:, 2] == pytest.approx([0.0, *np.arange(10) * 0.3])
    assert not positions[:, :2].any()


def test_positions_of_a_batch_are_those_of_its_arms(arm):
    q = np.random.default_rng(0).normal(size=(2, 3, 10))
    batch = kinematics.joint_positions(arm, q)
    assert batch.shape == (2, 3, 11, 3)
    np.testing.assert_array_equal(batch[1, 2], kinematics.joint_positions(arm, q[1, 2]))


@given(cases())
def test_constraint_jacobian_and_bias_are_derivatives_of_the_elbows_height(case):
    arm, q, q_dot, *_, elbows = case
    heights = lambda pose: kinematics.elbow_heights(arm, pose, elbows)  # noqa: E731
    jacobian = lambda pose: kinematics.constraint_jacobian(arm, pose, elbows)  # noqa: E731
    steps = NUDGE * np.eye(arm.n_joints)
    slopes = [(heights(q + step) - heights(q - step)) / (2.0 * NUDGE) for step in steps]
    np.testing.assert_allclose(jacobian(q), np.transpose(slopes), atol=1e-8)
    rate = (jacobian(q + NUDGE * q_dot) - jacobian(q - NUDGE * q_dot)) / (2.0 * NUDGE)
    np.testing.assert_allclose(kinematics.constraint_bias(arm, q, q_dot, elbows), rate @ q_dot, rtol=1e-7, atol=1e-6)


@given(cases())
def test_radial_jacobian_is_the_derivative_of_the_radius_and_the_radius_is_the_distance_from_the_yaw_axis(case):
    arm, q = case.arm, case.q
    points = range(3, arm.n_joints + 2)
    steps = NUDGE * np.eye(arm.n_joints)
    slopes = [
        (kinematics.radii(arm, q + step, points) - kinematics.radii(arm, q - step, points)) / (2.0 * NUDGE)
        for step in steps
    ]
    np.testing.assert_allclose(kinematics.radial_jacobian(arm, q, points), np.transpose(slopes), atol=1e-8)
    positions = kinematics.joint_positions(arm, q)[2:]
    np.testing.assert_allclose(
        np.abs(kinematics.radii(arm, q, points)), np.hypot(positions[:, 0], positions[:, 1]), atol=1e-12
    )


def test_the_hand_is_the_point_after_the_last_joint(arm):
    q = np.random.default_rng(5).normal(size=10)
    assert kinematics.elbow_heights(arm, q, [11]) == kinematics.hand_position(arm, q)[2]
    steps = NUDGE * np.eye(10)
    slopes = [
        (kinematics.hand_position(arm, q + step) - kinematics.hand_position(arm, q - step))[2] / (2.0 * NUDGE)
        for step in steps
    ]
    np.testing.assert_allclose(kinematics.constraint_jacobian(arm, q, [11])[0], slopes, atol=1e-8)


@pytest.mark.parametrize("elbows", [(4,), (4, 7), (3, 5, 8)])
def test_elbows_of_a_pose_on_the_table_are_at_zero(arm, elbows):
    found = kinematics.on_table(arm, arm.nominal_pose, elbows)
    np.testing.assert_allclose(kinematics.elbow_heights(arm, found, elbows), 0.0, atol=1e-12)


@pytest.mark.parametrize("elbows", [(4,), (4, 7)])
def test_pose_near_the_table_is_moved_to_where_the_simulator_moves_it(arm, elbows):
    q = np.array(arm.nominal_pose) + np.random.default_rng(3).normal(scale=0.02, size=10)
    found = kinematics.on_table(arm, q, elbows)
    np.testing.assert_allclose(found, Simulator(arm, elbows, 1).on_table(q)[0], atol=1e-10)


def test_elbow_that_cannot_reach_the_table_is_refused(arm):
    upright = replace(arm, links=(*arm.links[:2], LinkParameters(length=2.0), *arm.links[3:]))
    with pytest.raises(ValueError, match=r"^elbows must be able to lie on the table, got heights "):
        kinematics.on_table(upright, np.zeros(10), (4,))


@given(angles, between(-0.1, 0.02))
def test_inverse_kinematics_puts_the_hand_on_the_target(arm, angle, height):
    target = circle(angle)[0] + [0.0, 0.0, height]
    q, q_dot = kinematics.inverse_kinematics(arm, arm.nominal_pose, target)
    np.testing.assert_allclose(kinematics.hand_position(arm, q), target, atol=1e-14)
    assert q[0] == np.arctan2(target[1], target[0])
    assert 0.0 < q[-1] < np.pi
    np.testing.assert_array_equal(q[1:-2], arm.nominal_pose[1:-2])
    assert not q_dot.any()


@given(angles)
def test_inverse_kinematics_rates_are_the_exact_derivative(arm, angle):
    _, rates = kinematics.inverse_kinematics(arm, arm.nominal_pose, *circle(angle))
    before, after = (
        kinematics.inverse_kinematics(arm, arm.nominal_pose, circle(angle + step)[0])[0] for step in (-NUDGE, NUDGE)
    )
    np.testing.assert_allclose(rates, (after - before) / (2.0 * NUDGE), atol=1e-8)


@given(between(-3.0, 3.0), between(-1.0, 1.0), between(0.3, 2.8))
def test_inverse_kinematics_undoes_the_forward_one_where_links_differ(yaw, turn, bend):
    arm = uneven_arm()
    q, rates = np.array(arm.nominal_pose), np.zeros(10)
    q[0], q[-1] = yaw, bend
    q[-2] += turn
    rates[[0, -2, -1]] = 0.7, -1.3, 0.9
    before, position, after = (kinematics.hand_position(arm, q + step * rates) for step in (-NUDGE, 0.0, NUDGE))
    found = kinematics.inverse_kinematics(arm, arm.nominal_pose, position, (after - before) / (2.0 * NUDGE))
    np.testing.assert_allclose(found, (q, rates), atol=1e-7)


@given(st.lists(angles, min_size=2, max_size=5))
def test_inverse_kinematics_of_a_batch_is_that_of_its_targets(arm, batch):
    points, velocities = (np.array(part) for part in zip(*map(circle, batch), strict=True))
    together = kinematics.inverse_kinematics(arm, arm.nominal_pose, points, velocities)
    alone = [kinematics.inverse_kinematics(arm, arm.nominal_pose, *circle(angle)) for angle in batch]
    np.testing.assert_allclose(together, np.swapaxes(alone, 0, 1), rtol=0.0, atol=1e-14)


def test_joint_nine_stays_on_its_turn(arm):
    pose = np.array(arm.nominal_pose)
    near = kinematics.inverse_kinematics(arm, pose, circle(1.0)[0])[0]
    pose[8] += 2.0 * np.pi
    far = kinematics.inverse_kinematics(arm, pose, circle(1.0)[0])[0]
    assert far[8] - near[8] == pytest.approx(2.0 * np.pi)
    assert abs(near[8] - arm.nominal_pose[8]) < np.pi


@pytest.mark.parametrize(("last_length", "height", "missing"), [(0.3, 0.85, "0.25"), (0.1, 0.05, "0.15")])
def test_an_unreachable_target_says_by_how_much(arm, last_length, height, missing):
    arm = replace(arm, links=(*arm.links[:-1], LinkParameters(length=last_length)))
    # Joint 9 of the start pose: five of the seven links before it lean 45 degrees off the vertical, two lie flat.
    rho, z = 0.3 * (2.0 + 5.0 * np.sqrt(0.5)), 0.3 * np.sqrt(0.5)
    with pytest.raises(ValueError, match=rf"within reach of the last two links, got a point {missing} m outside it"):
        kinematics.inverse_kinematics(arm, arm.nominal_pose, [rho, 0.0, z + height])


def test_nearest_turn_moves_joints_1_and_n_minus_1_alone_and_by_whole_turns():
    q_d = np.array([[-3.1, 0.2, 9.0, 0.0], [1.0, 0.2, 3.1, 0.0]])
    q = np.array([[3.1, 7.0, -3.1, 7.0], [2.0, 7.0, -3.1, 7.0]])
    turned = kinematics.nearest_turn(q_d, q)
    turn = 2.0 * np.pi
    np.testing.assert_allclose(turned, [[turn - 3.1, 0.2, 9.0 - 2.0 * turn, 0.0], [1.0, 0.2, 3.1 - turn, 0.0]])
    near = q_d + 3.0
    assert kinematics.nearest_turn(q_d, near) is q_d


@pytest.mark.parametrize("elbows", [(), (4,), (4, 7)])
def test_reaching_pose_has_the_hand_at_the_point_the_elbows_down_and_no_joint_below(arm, elbows):
    # Beyond and above what the last two links reach from the start pose.
    for point in ((1.65, 1.75, 0.6), (0.0, 1.2, 0.7)):
        q = kinematics.reaching_pose(arm, arm.nominal_pose, elbows, point)
        np.testing.assert_allclose(kinematics.hand_position(arm, q), point, rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(kinematics.elbow_heights(arm, q, elbows), 0.0, atol=1e-11)
        assert kinematics.joint_positions(arm, q)[:-1, 2].min() > -1e-11


def test_reaching_pose_turns_links_no_more_than_another_that_reaches(arm):
    point = kinematics.hand_position(arm, arm.nominal_pose) + np.array([0.0, 0.02, 0.01])
    near = kinematics.reaching_pose(arm, arm.nominal_pose, (), point)
    alone = kinematics.inverse_kinematics(arm, arm.nominal_pose, point)[0]
    turned, more = (np.linalg.norm(kinematics.pitches(q) - kinematics.pitches(arm.nominal_pose)) for q in (near, alone))
    assert 0.0 < turned < 0.8 * more


def test_a_point_out_of_the_hands_reach_is_refused_with_the_distance(arm):
    with pytest.raises(ValueError, match=r"^position must be within the hand's reach with joints \[4.*\] on the table"):
        kinematics.reaching_pose(arm, arm.nominal_pose, (4,), (2.0, 2.0, 0.4))

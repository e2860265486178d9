import math

import numpy as np
import pytest

from elbow_gym import Circle, Simulator, paper_arm, task
from elbow_gym.kinematics import hand_position

ARM = paper_arm()
CIRCLE = Circle(plane="radial", radius=0.2, period=4.0)
ANGLE = np.array([0.3, -2.0, 7.0])
POSE = np.array(ARM.nominal_pose)
LAYOUT = task.ObservationLayout(10)
FEATURES = {feature.name: feature for feature in task.FEATURES}


def arms():
    """Three arms without elbows in random states with 0.01 s of motion behind them."""
    rng = np.random.default_rng(7)
    simulator = Simulator(ARM, 0, 3, timestep=0.002)
    simulator.reset(POSE + rng.normal(size=(3, 10)), rng.normal(size=(3, 10)), 2.0 * rng.normal(size=10))
    simulator.step(10.0 * rng.normal(size=(3, 10)), 5)
    return simulator


def look(simulator):
    path = np.repeat(CIRCLE.path[None], 3, axis=0)
    return task.look(LAYOUT, simulator, POSE, path, ANGLE, CIRCLE.rate * task.LOOKAHEAD)


def truth(simulator):
    """What each feature means, from the simulator's state, the kinematics and the circle."""
    hand = hand_position(ARM, simulator.q)
    later = CIRCLE.position(ANGLE + 2.0 * math.pi / CIRCLE.period * 0.1)
    return {
        "joint_angle": simulator.q - POSE,
        "joint_velocity": simulator.q_dot,
        "current": simulator.current,
        "hand_error": hand - CIRCLE.position(ANGLE),
        "hand_position": hand - np.array(CIRCLE.center),
        "lookahead_error": hand - later,
        "target_angle": np.stack([np.cos(ANGLE), np.sin(ANGLE)], axis=1),
    }


@pytest.mark.parametrize("n", [3, 10, 20])
def test_layout_gives_three_entries_a_joint_three_errors_and_an_angle(n):
    layout = task.ObservationLayout(n)
    assert layout.sizes == (n, n, n, 3, 3, 3, 2)
    assert layout.size == 3 * n + 11 == len(layout.names) == layout.scale.size == layout.high.size
    ends = [where.stop for where in layout.slices.values()]
    assert [where.start for where in layout.slices.values()] == [0, *ends[:-1]]
    assert list(layout.slices) == list(FEATURES)


def test_names_carry_joint_or_axis_and_unit():
    names = np.array(LAYOUT.names)
    assert list(names[LAYOUT.slices["joint_angle"]][[0, 9]]) == ["joint_angle_1 [rad]", "joint_angle_10 [rad]"]
    assert names[LAYOUT.slices["joint_velocity"]][1] == "joint_velocity_2 [rad/s]"
    assert names[LAYOUT.slices["current"]][2] == "current_3 [A]"
    assert list(names[LAYOUT.slices["hand_error"]]) == [f"hand_error_{axis} [m]" for axis in "xyz"]
    assert list(names[-2:]) == ["target_angle_cos [-]", "target_angle_sin [-]"]
    assert len(set(LAYOUT.names)) == LAYOUT.size


def test_scale_and_bounds_repeat_the_features():
    for name, where in LAYOUT.slices.items():
        np.testing.assert_array_equal(LAYOUT.scale[where], FEATURES[name].scale)
        np.testing.assert_allclose(LAYOUT.high[where] * LAYOUT.scale[where], FEATURES[name].limit, rtol=1e-6)


@pytest.mark.parametrize("name", FEATURES)
def test_decoded_observation_is_what_simulator_and_circle_say(name):
    simulator = arms()
    sight = look(simulator)
    assert sight.observation.dtype == np.float32
    np.testing.assert_allclose(LAYOUT.decode(sight.observation)[name], truth(simulator)[name], rtol=1e-7, atol=1e-8)


def test_decode_takes_one_arm_or_many():
    observation = look(arms()).observation
    assert LAYOUT.decode(observation[0])["current"].shape == (10,)
    np.testing.assert_array_equal(LAYOUT.decode(observation[1])["current"], LAYOUT.decode(observation)["current"][1])


def test_lookahead_is_the_error_to_the_target_a_tenth_of_a_second_later():
    assert task.LOOKAHEAD == 0.1
    seen = LAYOUT.decode(look(arms()).observation)
    moved = seen["hand_error"] - seen["lookahead_error"]
    np.testing.assert_allclose(
        moved, CIRCLE.position(ANGLE + math.pi / 20.0) - CIRCLE.position(ANGLE), atol=1e-6, rtol=0.0
    )


def test_bounds_saturate_the_observation_and_never_the_state():
    simulator = Simulator(ARM, 0, 3)
    signs = np.where(np.arange(30).reshape(3, 10) % 3 == 0, -1.0, 1.0)
    simulator.reset(POSE, 101.0 * signs, 1e300 * signs)
    before = simulator.get_state()
    seen = look(simulator).observation
    for name in ("joint_velocity", "current"):
        np.testing.assert_allclose(LAYOUT.decode(seen)[name], FEATURES[name].limit * signs, rtol=1e-6)
    assert (np.abs(seen) <= LAYOUT.high).all()
    for name, array in simulator.get_state().items():
        np.testing.assert_array_equal(array, before[name])


def test_figures_are_the_error_norm_and_the_meters_summed_over_the_joints():
    simulator = arms()
    sight = look(simulator)
    np.testing.assert_allclose(sight.tracking_error, np.linalg.norm(truth(simulator)["hand_error"], axis=1), rtol=1e-13)
    for name in ("electrical_energy", "drawn_energy", "link_work"):
        np.testing.assert_allclose(getattr(sight, name), getattr(simulator, name).sum(axis=1), rtol=1e-13)


def test_one_watt_weighs_one_millimetre_by_default():
    tracking, energy = task.reward_terms(np.array([0.001, 0.0]), np.array([0.0, 1.0]), 1.0, 0.001)
    np.testing.assert_array_equal(tracking, [-0.001, 0.0])
    np.testing.assert_array_equal(energy, [0.0, -0.001])


def test_reward_terms_are_weight_times_quantity_and_regeneration_pays():
    tracking, energy = task.reward_terms(np.array([0.5]), np.array([-4.0]), 3.0, 0.25)
    np.testing.assert_array_equal(tracking, [-1.5])
    np.testing.assert_array_equal(energy, [1.0])

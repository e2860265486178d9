"""The observation's entries, scales and bounds, and the reward's terms, against the simulator's state."""

import math
from fractions import Fraction

import numpy as np
import pytest

from elbow_gym import Circle, Simulator, paper_arm
from elbow_gym.kernel.build import kernel
from elbow_gym.kernel.rows import AHEAD, PAID, PHASE, TASK_COLUMNS, TURN
from elbow_gym.kernel.slots import BLOCK_LANES
from elbow_gym.kinematics import hand_position
from elbow_gym.task import observation as task
from elbow_gym.task.reward import Price
from elbow_gym.task.sensing import blank

ARM = paper_arm()
CIRCLE = Circle(plane="radial", radius=0.2, period=4.0)
ANGLE = np.array([0.3, -2.0, 7.0])
POSE = np.array(ARM.nominal_pose)
FREE = Price(0.0, 0.0, 0.0, regeneration=True)
LAYOUT = task.ObservationLayout(10)
FEATURES = {feature.name: feature for feature in task.FEATURES}


# Shipped policies rest on these: what changes them is another version.
VERSION_1 = {
    "joint_angle": ("rad", 0.3, 10.0),
    "joint_velocity": ("rad/s", 2.0, 100.0),
    "current": ("A", 5.0, 500.0),
    "hand_error": ("m", 0.5, 10.0),
    "hand_position": ("m", 0.5, 10.0),
    "lookahead_error": ("m", 0.5, 10.0),
    "target_angle": ("-", 1.0, 1.0),
    "contact_force": ("N", 5.0, 1e4),
    "temperature_rise": ("K", 50.0, 1e4),
    "pending_voltage": ("V", 24.0, 1e4),
    "further_error": ("m", 0.5, 10.0),
    "target_velocity": ("m/s", 0.2, 100.0),
    "circle_radius": ("m", 0.1, 10.0),
    "angular_velocity": ("rad/s", 1.0, 1000.0),
    "plane_normal": ("-", 1.0, 1.0),
    "payload": ("kg", 0.1, 100.0),
    "time_left": ("-", 1.0, 1.0),
}


def test_units_scales_and_limits_are_those_of_version_1():
    features = (*task.FEATURES, *task.SWITCHED_FEATURES, *task.TASK_FEATURES)
    found = {one.name: (one.unit, one.scale, one.limit) for one in features}
    assert (task.OBSERVATION_VERSION, found) == (1, VERSION_1)


def arms():
    """Three arms without elbows in random states with 0.01 s of motion behind them."""
    rng = np.random.default_rng(7)
    simulator = Simulator(ARM, 0, 3, timestep=0.002)
    simulator.reset(POSE + rng.normal(size=(3, 10)), rng.normal(size=(3, 10)), 2.0 * rng.normal(size=10))
    simulator.step(10.0 * rng.normal(size=(3, 10)), 5)
    return simulator


def look(simulator, price=FREE, spent=0.0, paid=None):
    asked = np.zeros((3, TASK_COLUMNS))
    # Two control periods of 0.1 rad on.
    asked[:, PHASE], asked[:, TURN], asked[:, AHEAD] = ANGLE - 0.2, 0.1, CIRCLE.rate * task.LOOKAHEAD
    asked[:, PAID] = spent if paid is None else paid
    sight, path = blank(3, LAYOUT.size), np.repeat(CIRCLE.path[None], 3, axis=0)
    layout = (POSE, LAYOUT.starts, np.stack([LAYOUT.scale, LAYOUT.high]))
    clock = np.full((3, 2), 2)
    own = (*simulator.raw[:2], clock, asked, path, *layout, np.array(price), *sight)
    kernel(BLOCK_LANES).observe(*own, first=0, end=3)
    assert (clock == 2).all()
    if paid is not None:
        paid[:] = asked[:, PAID]
    return sight


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
    error = np.linalg.norm(truth(simulator)["hand_error"], axis=1)
    np.testing.assert_allclose(sight.figure("tracking_error"), error, rtol=1e-13)
    for name in ("electrical_energy", "drawn_energy", "link_work"):
        np.testing.assert_allclose(sight.figure(name), getattr(simulator, name).sum(axis=1), rtol=1e-13)


@pytest.mark.parametrize(("regeneration", "meter"), [(True, "electrical_energy"), (False, "drawn_energy")])
def test_reward_terms_are_weight_times_error_and_mean_power(regeneration, meter):
    simulator = arms()
    sight = look(simulator, Price(3.0, 0.25, 50.0, regeneration), spent=2.0)
    power = (getattr(simulator, meter).sum(axis=1) - 2.0) * 50.0
    np.testing.assert_allclose(sight.figure("electrical_power"), power, rtol=1e-12)
    np.testing.assert_array_equal(sight.figure("reward_tracking"), -3.0 * sight.figure("tracking_error"))
    np.testing.assert_array_equal(sight.figure("reward_energy"), -0.25 * sight.figure("electrical_power"))
    error, power = (sight.figure(name) for name in ("tracking_error", "electrical_power"))
    # Rounded once where BLAS rounds once.
    exact = [
        float(Fraction(-p) * Fraction(0.25) + Fraction(float(-3.0 * e))) for e, p in zip(error, power, strict=True)
    ]
    np.testing.assert_array_equal(sight.figure("reward"), exact)


def test_a_look_between_steps_is_free_and_remembers_what_is_paid():
    simulator, spent = arms(), np.zeros(3)
    sight = look(simulator, paid=spent)
    np.testing.assert_array_equal(sight.figures[[1, 5, 6, 8]], 0.0)
    np.testing.assert_allclose(spent, simulator.electrical_energy.sum(axis=1), rtol=1e-13)

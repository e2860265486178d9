"""The classical controllers do what their names say, seen through the environment alone."""

from functools import partial

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from agents.control import classical
from agents.control.classical import (
    COMPUTED,
    ComputedTorque,
    GravityPD,
    Reference,
    SmoothPD,
    economical_pose,
    task_pose,
)
from agents.control.minimum_jerk import minimum_jerk
from agents.control.posture import best_postures, static_copper_loss
from agents.evaluation.metrics import metrics
from agents.evaluation.players import CLASSICAL
from agents.optimal.guesses import rollout
from elbow_gym import ElbowArmEnv, Simulator
from elbow_gym.baselines.pd import CLIPPED
from elbow_gym.kinematics import hand_position, inverse_kinematics, joint_positions, on_table
from elbow_gym.task.circle import Circle
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv


def test_minimum_jerk_starts_and_ends_at_rest_without_acceleration():
    blend, slope, curvature = minimum_jerk([-1.0, 0.0, 1.0, 2.0])
    np.testing.assert_array_equal(blend, [0.0, 0.0, 1.0, 1.0])
    np.testing.assert_array_equal(slope, 0.0)
    np.testing.assert_array_equal(curvature, 0.0)


def test_minimum_jerk_derivatives_are_the_blends():
    s, step = np.linspace(0.05, 0.95, 19), 1e-5
    (_, slope, curvature), ahead, behind = minimum_jerk(s), minimum_jerk(s + step), minimum_jerk(s - step)
    np.testing.assert_allclose(slope, (ahead[0] - behind[0]) / (2 * step), atol=1e-8)
    np.testing.assert_allclose(curvature, (ahead[1] - behind[1]) / (2 * step), atol=1e-7)


def test_reference_leaves_the_arms_pose_and_ends_with_the_hand_on_the_target():
    env = ElbowArmVectorEnv(1, **COMPUTED)
    reference, start = Reference(env, None, 0.1), np.array([env.episodes.pose]) + 0.01
    motions = [reference.next(np.array([0.3]), start) for _ in range(60)]
    np.testing.assert_allclose(motions[0].q, start, atol=1e-12)
    np.testing.assert_allclose(motions[0].q_dot, 0.0, atol=1e-12)
    expected = env.episodes.circle.position(np.array([0.3]))
    np.testing.assert_allclose(hand_position(env.episodes.arm, motions[-1].q), expected, atol=1e-12)


@pytest.mark.parametrize("elbows", [0, 1, 2])
def test_gravity_feed_forward_alone_holds_the_start_pose(arm, elbows):
    env = ElbowArmVectorEnv(1, elbows=elbows, start_noise=0.0, **CLIPPED)
    observation, _ = env.reset(seed=0)
    # At the first call the reference is the pose itself: what remains is the feed-forward.
    voltage, _ = GravityPD(env).predict(observation)
    simulator = Simulator(arm, elbows)
    current = voltage / arm.of_motors("armature_resistance")
    simulator.reset(env.episodes.pose, current=current)
    simulator.step(voltage.astype(float), 50)
    np.testing.assert_allclose(simulator.q[0], env.episodes.pose, atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("elbows", [0, 1, 2])
def test_computed_torque_tracks_without_the_paper_pds_sag(elbows):
    def error_rms(name):
        arguments, make, _ = CLASSICAL[name]
        settings = Settings(elbows=elbows, start="on_target", duration=1.6, **arguments)
        _, recording = rollout(settings, make)
        # The smooth reference has reached the target after a second.
        late = recording.time > 1.2
        error = np.linalg.norm(recording.hand - recording.target, axis=-1)[late]
        return np.sqrt((error**2).mean())

    assert error_rms("computed_torque") < 0.2 * error_rms("pd")


@pytest.mark.slow
def test_smooth_start_costs_less_than_the_step_and_is_there_sooner():
    figures = {}
    for name in ("pd", "pd_smooth"):
        arguments, make, _ = CLASSICAL[name]
        figures[name] = metrics(rollout(Settings(duration=1.5, **arguments), make)[1])
    assert figures["pd_smooth"]["electrical_energy"] < 0.7 * figures["pd"]["electrical_energy"]
    assert figures["pd_smooth"]["error_mean"] < figures["pd"]["error_mean"]


def test_economical_pose_keeps_the_elbows_down_and_costs_less_than_the_papers(arm, monkeypatch):
    elbows, circle = (4,), Circle()
    # The first of its searches, from the paper's pose, is enough.
    monkeypatch.setattr(classical, "best_postures", partial(best_postures, starts=1))
    pose = economical_pose(arm, elbows, circle)
    heights = joint_positions(arm, pose)[2:, 2]
    assert abs(heights[1]) < 1e-5
    assert heights.min() > -1e-5
    angle = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    mine, papers = (
        static_copper_loss(arm, elbows, inverse_kinematics(arm, q, circle.position(angle))[0]).mean()
        for q in (pose, arm.nominal_pose)
    )
    assert mine < 0.75 * papers


def test_economical_pose_is_the_start_where_no_posture_serves_the_circle(arm, monkeypatch):
    def refuse(*_, **_more):
        raise ValueError("circle must allow a posture with the elbows (5,) down, got none in 12 searches")

    monkeypatch.setattr(classical, "best_postures", refuse)
    np.testing.assert_array_equal(economical_pose(arm, (5,), Circle()), on_table(arm, arm.nominal_pose, (5,)))


@pytest.mark.parametrize("name", ["pd", "pd_smooth", "pd_gravity", "computed_torque"])
def test_controllers_are_independent_of_the_batch(name):
    arguments, make, _ = CLASSICAL[name]
    env = ElbowArmVectorEnv(3, duration=0.1, **arguments)
    observation, _ = env.reset(seed=0)
    together, alone = make(env), make(env)
    for _ in range(3):
        action, _ = together.predict(observation)
        np.testing.assert_allclose(action[1:2], alone.predict(observation[1:2])[0], rtol=1e-6, atol=1e-4)
        observation, *_ = env.step(action)


@pytest.mark.parametrize("elbows", [(), (4,), (4, 7)])
def test_the_posture_found_depends_on_no_number_of_threads(arm, elbows):
    found = []
    for threads in (1, 2):
        with threadpool_limits(threads, user_api="blas"):
            found.append(best_postures(arm, elbows, Circle(), starts=1)[0].pose)
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("make", [SmoothPD, ComputedTorque])
def test_single_arm_on_a_drawn_circle_is_played_as_in_a_batch_of_one(make):
    options = {**COMPUTED, "circle": {"radius": [0.05, 0.15], "period": [4.0, 6.0], "phase": "random"}}
    env, batch = ElbowArmEnv(elbows=2, **options), ElbowArmVectorEnv(1, elbows=2, **options)
    controller, batched = make(env), make(batch)
    observation, rows = env.reset(seed=2)[0], batch.reset(seed=2)[0]
    for _ in range(20):
        observation, rows = env.step(controller.predict(observation)[0])[0], batch.step(batched.predict(rows)[0])[0]
        np.testing.assert_array_equal(observation, rows[0])


@pytest.mark.slow
def test_task_pose_is_the_start_pose_where_that_reaches_and_one_that_does_elsewhere(arm):
    reached = Circle()
    start = on_table(arm, arm.nominal_pose, (4, 7))
    np.testing.assert_array_equal(task_pose(arm, (4, 7), reached), start)
    far = Circle(center=(1.65, 1.65, 0.55), radius=0.15)
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    with pytest.raises(ValueError, match="position must be within reach of the last two links"):
        inverse_kinematics(arm, start, far.position(angle))
    pose = task_pose(arm, (4, 7), far, 0.2)
    q, _ = inverse_kinematics(arm, pose, far.position(angle))
    np.testing.assert_allclose(hand_position(arm, q), far.position(angle), atol=1e-9)
    np.testing.assert_allclose(joint_positions(arm, q)[:, [3, 6], 2], 0.0, atol=1e-6)


def test_computed_torque_that_is_told_of_its_load_does_not_sag():
    def error(payload):
        make = partial(ComputedTorque, payload=payload)
        settings = Settings(payload=0.2, start="on_target", start_noise=0.0, duration=0.8, **COMPUTED)
        return metrics(rollout(settings, make)[1], 0.7)["error_rms"][0]

    assert error(0.2) < 1.0  # mm
    assert error(0.0) > 100.0

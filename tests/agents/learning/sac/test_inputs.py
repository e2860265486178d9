"""Inputs of the critics: lengths, small values stretched, and where the hand is heading."""

import numpy as np
import pytest

pytest.importorskip("torch")

import torch

from agents.learning.sac.inputs import AHEAD, GAIN, VELOCITY_SCALE, Foresight, Sharpened
from elbow_gym.kinematics import hand_position
from elbow_gym.parameters import paper_arm
from elbow_gym.vector_env import ElbowArmVectorEnv


def test_lengths_and_stretched_vectors_stand_behind_the_observation():
    view = Sharpened(4, [slice(1, 4), slice(2, 4)])
    seen = view(torch.tensor([[0.3, 0.0, 0.03, -0.04]]))
    expected = [0.3, 0.0, 0.03, -0.04, 0.05, 0.05]
    expected += [0.5 * np.arcsinh(50.0 * value) for value in (0.0, 0.03, -0.04, 0.03, -0.04)]
    assert seen[0].tolist() == pytest.approx([GAIN * value for value in expected], abs=1e-6)
    assert seen.shape == (1, view.size)


@pytest.fixture(scope="module")
def moving():
    """Arms in motion: view, layout, what is seen and the quantities behind it."""
    env = ElbowArmVectorEnv(4, elbows=0)
    observation, _ = env.reset(seed=3)
    rng = np.random.default_rng(0)
    for _ in range(15):
        observation, *_ = env.step(rng.uniform(-0.4, 0.4, env.action_space.shape).astype(np.float32))
    episodes = env.episodes
    view = Foresight(episodes.layout, episodes.arm, episodes.pose)
    return view, episodes, torch.from_numpy(observation)


def test_velocity_is_the_rate_of_the_hand_less_the_target(moving):
    view, episodes, observation = moving
    seen = episodes.layout.decode(observation.numpy())
    q, step = seen["joint_angle"] + episodes.pose, 1e-6
    ends = [[hand_position(paper_arm(), q[k] + s * seen["joint_velocity"][k]) for s in (step, -step)] for k in range(4)]
    hand = np.array([(ahead - behind) / (2.0 * step) for ahead, behind in ends])
    angle = np.arctan2(seen["target_angle"][:, 1], seen["target_angle"][:, 0])
    circle = episodes.circle
    later = angle + circle.rate * 0.1
    expected = hand - (circle.position(later) - circle.position(angle)) / 0.1
    assert np.abs(expected).max() > 1.0
    np.testing.assert_allclose(view.velocity(observation).numpy(), expected, atol=1e-4)


def test_errors_ahead_are_the_error_and_its_way_at_this_velocity(moving):
    view, episodes, observation = moving
    error = episodes.layout.decode(observation.numpy())["hand_error"]
    velocity = view.velocity(observation).numpy()
    seen, size = view(observation).numpy() / GAIN, episodes.layout.size
    assert seen.shape == (4, view.size)
    np.testing.assert_allclose(seen[:, :size], observation.numpy(), rtol=1e-6)
    for k, time in enumerate(AHEAD):
        ahead = (error + time * velocity) / 0.5
        np.testing.assert_allclose(seen[:, size + 3 * k : size + 3 * k + 3], ahead, atol=1e-5)
        # Lengths come after the velocity: of the error, the look-ahead error, and these.
        length = seen[:, size + 3 * len(AHEAD) + 3 + 2 + k]
        np.testing.assert_allclose(length, np.linalg.norm(ahead, axis=1), rtol=1e-5)
    velocities = seen[:, size + 3 * len(AHEAD) :][:, :3]
    np.testing.assert_allclose(velocities, velocity / VELOCITY_SCALE, rtol=1e-5)

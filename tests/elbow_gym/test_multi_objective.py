"""The vector reward of MO-Gymnasium's conventions, and the scalar one as its weighted sum."""

import gymnasium as gym
import numpy as np
import pytest

import elbow_gym  # noqa: F401

WEIGHTS = np.array([1.0, 0.001])
# 1 - (1 + 2^-30) (1 - 2^-30) is 2^-60 if the product is not rounded, and 0 if it is.
FUSED = np.dot(np.array([1.0, 1.0 + 2.0**-30]), np.array([-1.0, 1.0 - 2.0**-30])) != 0.0
rounds_once = pytest.mark.skipif(not FUSED, reason="this BLAS rounds twice: its weighted sums are off by a last bit")


def play(env, steps=60):
    env.reset(seed=3)
    rng = np.random.default_rng(0)
    for _ in range(steps):
        yield env.step(rng.uniform(-1.0, 1.0, 10).astype(np.float32))


def test_reward_is_minus_error_and_minus_power():
    env = gym.make("mo-ElbowArm-v0", elbows=1)
    assert env.unwrapped.reward_space.shape == (env.unwrapped.reward_dim,) == (2,)
    for _, reward, _, _, info in play(env):
        np.testing.assert_array_equal(reward, [-info["tracking_error"], -info["electrical_power"]])
        assert reward in env.unwrapped.reward_space


@rounds_once
def test_weighted_sum_is_the_scalar_environments_reward_exactly():
    vector, scalar = gym.make("mo-ElbowArm-v0"), gym.make("ElbowArm-v0")
    for many, one in zip(play(vector), play(scalar), strict=True):
        assert np.dot(many[1], WEIGHTS) == one[1]
        np.testing.assert_array_equal(many[0], one[0])


@rounds_once
def test_linear_reward_of_mo_gymnasium_is_the_scalar_environment():
    wrappers = pytest.importorskip("mo_gymnasium.wrappers", reason="mo-gymnasium is not installed")
    vector = wrappers.LinearReward(gym.make("mo-ElbowArm-v0"), weight=WEIGHTS)
    for many, one in zip(play(vector), play(gym.make("ElbowArm-v0")), strict=True):
        assert many[1] == one[1]


def test_weights_are_the_scalarisations():
    with pytest.raises(ValueError, match=r"^energy_weight must be left to the scalarisation of the reward, got 0\.1$"):
        gym.make("mo-ElbowArm-v0", energy_weight=0.1)
    env = gym.make("mo-ElbowArm-v0").unwrapped
    for change in (env.set_energy_weight, env.set_tracking_weight):
        with pytest.raises(gym.error.Error, match=r"must be left to the scalarisation, got 2\.0"):
            change(2.0)

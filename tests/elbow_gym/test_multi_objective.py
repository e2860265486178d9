"""The vector reward of MO-Gymnasium's conventions, and the scalar one as its weighted sum."""

import functools

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from elbow_gym.multi_objective import MOElbowArmEnv, MOElbowArmVectorEnv
from tests.support.arms import blow_up

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


@pytest.mark.parametrize("mode", AutoresetMode)
def test_batch_has_the_rewards_of_single_environments_in_every_autoreset_mode(mode):
    settings = {"duration": 0.08, "circle": {"phase": "random"}}
    batch = gym.make_vec("elbow_gym:mo-ElbowArm-v0", 3, autoreset_mode=mode, **settings)
    singles = [gym.make("mo-ElbowArm-v0", **settings) for _ in range(3)]
    assert batch.unwrapped.reward_space == singles[0].unwrapped.reward_space
    batch.reset(seed=7)
    for i, env in enumerate(singles):
        env.reset(seed=7 + i)
    rng, waiting = np.random.default_rng(0), False
    for _ in range(11):
        action = rng.uniform(-1.0, 1.0, (3, 10)).astype(np.float32)
        _, rewards, _, truncated, _ = batch.step(action)
        assert rewards.shape == (3, 2)
        if waiting:
            np.testing.assert_array_equal(rewards, 0.0)
            waiting = False
            continue
        for env, one, reward in zip(singles, action, rewards, strict=True):
            _, expected, _, over, _ = env.step(one)
            np.testing.assert_array_equal(reward, expected)
            if over:
                env.reset()
        assert truncated.all() == over
        if over and mode is AutoresetMode.DISABLED:
            batch.reset(options={"reset_mask": truncated})
        waiting = over and mode is AutoresetMode.NEXT_STEP


@pytest.mark.parametrize(
    "settings", [{}, {"elbows": 0, "duration": 2.0}, {"regeneration": False, "voltage_limit": 12.0}]
)
def test_reward_space_is_finite_and_holds_the_worst_that_can_be_charged_and_braking(settings):
    env = MOElbowArmEnv(**settings)
    space = env.reward_space
    assert np.isfinite([space.low, space.high]).all()
    assert (space.high[1] > 0.0) == settings.get("regeneration", True)
    observation, _ = env.reset(seed=0)
    highest = 0.0
    for _ in range(50):
        q_dot = env.decode(observation)["joint_velocity"]
        observation, reward, *_ = env.step(-np.sign(q_dot).astype(np.float32))
        assert reward in space
        highest = max(highest, reward[1])
    state = env.get_state()
    state["episodes"]["steps"][:] = 0
    env.set_state(state)
    blow_up(env)
    _, reward, terminated, *_ = env.step(np.zeros(10, np.float32))
    assert terminated
    np.testing.assert_allclose(reward, space.low, rtol=1e-12)


def test_reward_space_covers_the_strongest_supply_and_least_resistance_that_may_be_drawn():
    plain, drawn = (
        MOElbowArmVectorEnv(2, **more).reward_space
        for more in ({}, {"randomize": {"supply_voltage": [0.5, 2.0], "armature_resistance": [0.01, 1.5]}})
    )
    # Twice the stall current at 48 V and 0.011 ohm, and 500 A of the bound at 24 V, through ten motors and 250 periods.
    resistance = MOElbowArmEnv().episodes.arm.of_motors("armature_resistance")
    assert plain.low[1] == pytest.approx(-250 * 10 * 24.0 * 500.0, rel=1e-12)
    assert drawn.low[1] == pytest.approx(-250 * 2 * 48.0**2 * (1.0 / (0.01 * resistance)).sum(), rel=1e-12)
    assert drawn.low[0] == plain.low[0] == pytest.approx(-250 * np.sqrt(300.0), rel=1e-6)


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
    with pytest.raises(
        ValueError, match=r"^tracking_weight must be left to the scalarisation of the reward, got 2\.0$"
    ):
        gym.make_vec("mo-ElbowArm-v0", 2, tracking_weight=2.0)
    for env in (gym.make("mo-ElbowArm-v0").unwrapped, MOElbowArmVectorEnv(2)):
        for name in ("energy_weight", "tracking_weight"):
            for change in (getattr(env, f"set_{name}"), functools.partial(setattr, env, name)):
                with pytest.raises(gym.error.Error, match=rf"^{name} must be left to the scalarisation, got 2\.0"):
                    change(2.0)

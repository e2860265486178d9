"""The adapter for Stable-Baselines3, against its own vector of single environments."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize

from elbow_gym import ElbowArmVectorEnv
from elbow_gym.sb3 import SB3VecEnv

RANDOM = {"circle": {"phase": "random"}, "start_noise": 0.1, "duration": 0.16}
HORIZON = 8


def made(num_envs=3, **settings):
    return SB3VecEnv(ElbowArmVectorEnv(num_envs, autoreset_mode="SameStep", **{**RANDOM, **settings}))


def actions(num_envs, steps):
    return np.random.default_rng(1).uniform(-1.2, 1.2, (steps, num_envs, 10)).astype(np.float32)


def ended(env):
    """The answer of the step that ends the first episodes."""
    env.seed(0)
    env.reset()
    *_, last = (env.step(action) for action in actions(env.num_envs, HORIZON))
    return last


@pytest.mark.parametrize("elbows", [0, 2])
def test_equals_a_dummy_vec_env_of_singles_with_the_same_seeds_and_actions(elbows):
    ours = made(elbows=elbows)
    theirs = DummyVecEnv([lambda: gym.make("elbow_gym:ElbowArm-v0", elbows=elbows, **RANDOM)] * 3)
    for env in (ours, theirs):
        env.seed(11)
    np.testing.assert_array_equal(ours.reset(), theirs.reset())
    for action in actions(3, 2 * HORIZON + 1):
        *our_columns, our_infos = ours.step(action)
        *columns, infos = theirs.step(action)
        for mine, expected in zip(our_columns, columns, strict=True):
            assert mine.dtype == expected.dtype
            np.testing.assert_array_equal(mine, expected)
        for done, mine, expected in zip(columns[2], our_infos, infos, strict=True):
            assert set(mine) == (set(expected) if done else set())
            for key, value in mine.items():
                assert type(value) is type(expected[key])
                np.testing.assert_array_equal(value, expected[key])


def test_infos_are_empty_until_an_episode_ends_by_the_clock():
    env = made()
    env.reset()
    early = [env.step(action)[3] for action in actions(3, HORIZON - 1)]
    assert early == [[{}, {}, {}]] * (HORIZON - 1)
    observation, _, dones, infos = env.step(actions(3, 1)[0])
    assert dones.all()
    assert [info["TimeLimit.truncated"] for info in infos] == [True] * 3
    for row, info in zip(observation, infos, strict=True):
        assert info["terminal_observation"] in env.observation_space
        assert not np.array_equal(info["terminal_observation"], row)
        assert info["drawn_energy"] > 0.0


def test_end_by_a_state_that_blew_up_is_no_time_limit():
    env = made()
    env.reset()
    state = env.env.get_state()
    state["episodes"]["simulator"]["state"][1, 1] = 1e200
    env.env.set_state(state)
    *_, dones, infos = env.step(actions(3, 1)[0])
    assert dones.tolist() == [False, True, False]
    assert infos[1]["TimeLimit.truncated"] is False


def test_seeds_and_options_are_used_once():
    env = made()
    env.seed(4)
    first = env.reset()
    assert not np.array_equal(env.reset(), first)
    env.seed(4)
    np.testing.assert_array_equal(env.reset(), first)
    env.set_options({"phase": 0.0})
    np.testing.assert_array_equal(env.reset()[:, -2:], [[1.0, 0.0]] * 3)
    assert (env.reset()[:, -2] < 1.0).all()


def test_options_that_differ_between_arms_are_refused():
    env = made()
    env.set_options([{"phase": 0.0}, {"phase": 1.0}, {}])
    with pytest.raises(ValueError, match=r"^options must be the same for every arm, got "):
        env.reset()


def test_attributes_and_methods_reach_every_arm():
    env = made()
    assert env.get_attr("num_envs") == [3, 3, 3]
    assert env.get_attr("num_envs", indices=[0, 2]) == [3, 3]
    env.set_attr("note", "mine")
    assert env.get_attr("note", indices=1) == ["mine"]
    assert env.env_is_wrapped(Monitor) == [False] * 3
    assert env.env_method("set_energy_weight", 0.0) == [None] * 3
    env.env_method("set_tracking_weight", 0.0, indices=0)
    env.reset()
    assert not env.step(actions(3, 1)[0])[1].any()


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED])
def test_other_autoreset_modes_are_refused(mode):
    with pytest.raises(ValueError, match=f"^autoreset_mode must be .*SAME_STEP, got {mode}$"):
        SB3VecEnv(ElbowArmVectorEnv(2, autoreset_mode=mode))


def test_vec_monitor_logs_return_length_and_the_infos_totals():
    infos = ended(VecMonitor(made(), info_keywords=("electrical_energy", "drawn_energy")))[3]
    for info in infos:
        assert info["episode"]["l"] == HORIZON
        assert info["episode"]["r"] < 0.0
        assert info["episode"]["drawn_energy"] == info["drawn_energy"]


def test_ppo_learns_through_monitor_and_normaliser():
    env = VecNormalize(VecMonitor(made(4)))
    model = PPO("MlpPolicy", env, n_steps=16, batch_size=32, n_epochs=1, policy_kwargs={"net_arch": [8]}, device="cpu")
    model.learn(64)
    assert model.num_timesteps == 64
    assert [episode["l"] for episode in model.ep_info_buffer] == [HORIZON] * 8

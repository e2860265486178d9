"""The adapter for Stable-Baselines3, against its own vector of single environments."""

import functools
import re
import subprocess

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import (
    DictInfoToList,
    NormalizeReward,
    RecordEpisodeStatistics,
    RescaleAction,
)
from imageio_ffmpeg import get_ffmpeg_exe

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor, VecNormalize, VecVideoRecorder

from elbow_gym import ElbowArmVectorEnv
from elbow_gym.sb3 import SB3VecEnv
from tests.support.arms import blow_up

RANDOM = {"circle": {"phase": "random"}, "start_noise": 0.1, "duration": 0.16}
HORIZON = 8
same = functools.partial(data_equivalence, exact=True)


def plain(infos):
    """Infos with plain dicts inside: a single arm's draws are of a type that copies when somebody looks."""
    return [{key: dict(value) if isinstance(value, dict) else value for key, value in one.items()} for one in infos]


def made(num_envs=3, **settings):
    return SB3VecEnv(ElbowArmVectorEnv(num_envs, autoreset_mode="SameStep", **{**RANDOM, **settings}))


def actions(num_envs, steps):
    return np.random.default_rng(1).uniform(-1.2, 1.2, (steps, num_envs, 10)).astype(np.float32)


def to_torch(env):
    """The batch with tensors for arrays."""
    pytest.importorskip("array_api_compat", reason="Gymnasium's array conversions are not installed")
    from gymnasium.wrappers.vector import NumpyToTorch

    return NumpyToTorch(env)


def ended(env):
    """The answer of the step that ends the first episodes."""
    env.seed(0)
    env.reset()
    *_, last = (env.step(action) for action in actions(env.num_envs, HORIZON))
    return last


@pytest.mark.parametrize("settings", [{"elbows": 0}, {}, {"randomize": {"mass": [0.9, 1.1], "payload": [0.0, 0.1]}}])
def test_equals_a_dummy_vec_env_of_singles_with_the_same_seeds_and_actions(settings):
    ours = made(**settings)
    theirs = DummyVecEnv([lambda: gym.make("elbow_gym:ElbowArm-v0", **settings, **RANDOM)] * 3)
    for env in (ours, theirs):
        env.seed(11)
    np.testing.assert_array_equal(ours.reset(), theirs.reset())
    assert same(ours.reset_infos, plain(theirs.reset_infos))
    for action in actions(3, 2 * HORIZON + 1):
        *our_columns, our_infos = ours.step(action)
        *columns, infos = theirs.step(action)
        for mine, expected in zip(our_columns, columns, strict=True):
            assert mine.dtype == expected.dtype
            np.testing.assert_array_equal(mine, expected)
        for done, mine, expected in zip(columns[2], our_infos, infos, strict=True):
            assert same([mine], plain([expected]) if done else [{}])
        assert same(ours.reset_infos, plain(theirs.reset_infos))


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
    blow_up(env.env, 1)
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
    assert env.get_attr("action_space") == [env.action_space] * 3
    assert env.get_attr("observation_space", indices=2) == [env.observation_space]
    assert env.env_is_wrapped(Monitor) == [False] * 3
    assert env.env_method("set_energy_weight", 0.0) == [None] * 3
    env.set_attr("tracking_weight", 0.0, indices=[0, 1, 2])
    env.reset()
    assert not env.step(actions(3, 1)[0])[1].any()
    assert env.has_attr("energy_weight")
    assert not env.has_attr("energy_wait")


def test_some_of_the_arms_cannot_have_a_weight_of_their_own():
    env = made()
    for indices in (0, [0], [1, 2], [0, 0, 1]):
        with pytest.raises(
            ValueError, match=r"^indices of set_energy_weight must be all 3 arms, which share it, got \["
        ):
            env.env_method("set_energy_weight", 0.5, indices=indices)
        with pytest.raises(ValueError, match=r"^indices of energy_weight must be all 3 arms"):
            env.set_attr("energy_weight", 0.5, indices=indices)
    with pytest.raises(
        ValueError, match=r"^energy_weight must be the same for all 3 arms of a batch, got \[0.0, 0.5, 1.0\]"
    ):
        env.set_attr("energy_weight", [0.0, 0.5, 1.0])
    assert env.get_attr("energy_weight") == [0.001] * 3


def test_attributes_that_would_do_nothing_are_refused():
    env = made()
    with pytest.raises(AttributeError, match=r"^attribute of .* must be one that it has, got 'energy_wait'$"):
        env.set_attr("energy_wait", 5.0)
    with pytest.raises(AttributeError, match=r"^duration of ElbowArmVectorEnv must be given when it is made"):
        env.set_attr("duration", 10.0)
    with pytest.raises(ValueError, match=r"^get_state must be called on the batch itself"):
        env.env_method("get_state")


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED])
@pytest.mark.parametrize("wrap", [lambda env: env, NormalizeReward])
def test_other_autoreset_modes_are_refused(mode, wrap):
    env = wrap(ElbowArmVectorEnv(2, autoreset_mode=mode))
    with pytest.raises(
        ValueError, match=f'^autoreset_mode must be given as autoreset_mode="SameStep", got {mode} of '
    ) as e:
        SB3VecEnv(env)
    assert str(env) in str(e.value)


@pytest.mark.parametrize(
    ("env", "reason"),
    [
        (lambda: gym.make("elbow_gym:ElbowArm-v0"), r'must be a batch, such as .*autoreset_mode="SameStep"\), got <'),
        (
            lambda: gym.make_vec("CartPole-v1", 2),
            r"must be a batch of elbow_gym's, .*autoreset_mode=.SameStep.\), got CartPole",
        ),
        (
            lambda: gym.make_vec("elbow_gym:mo-ElbowArm-v0", 2, autoreset_mode="SameStep"),
            r"must have one reward per arm, .*got MOElbowArmVectorEnv",
        ),
        (
            lambda: DictInfoToList(ElbowArmVectorEnv(2, autoreset_mode="SameStep")),
            r'with autoreset_mode="SameStep" must give NumPy arrays and a dict of infos, got DictInfoToList$',
        ),
        (
            lambda: to_torch(ElbowArmVectorEnv(2, autoreset_mode="SameStep")),
            r'with autoreset_mode="SameStep" must give NumPy arrays and a dict of infos, got NumpyToTorch$',
        ),
    ],
)
def test_what_is_no_batch_of_arms_in_sb3s_form_is_refused_by_name(env, reason):
    with pytest.raises(ValueError, match=f"^env {reason}"):
        SB3VecEnv(env())


def test_wrappers_of_rewards_actions_and_statistics_work():
    batch = ElbowArmVectorEnv(3, autoreset_mode="SameStep", **RANDOM)
    env = SB3VecEnv(RescaleAction(RecordEpisodeStatistics(NormalizeReward(batch)), np.float32(-0.5), np.float32(0.5)))
    plain = made()
    for one in (env, plain):
        one.seed(0)
        one.reset()
    np.testing.assert_array_equal(env.action_space.high, 0.5)
    assert env.get_attr("action_space", 0) == [env.action_space]
    rewards = []
    for action in np.clip(actions(3, HORIZON), -1.0, 1.0):
        observation, reward, dones, infos = env.step(action / 2.0)
        expected, _, _, plain_infos = plain.step(action)
        np.testing.assert_array_equal(observation, expected)
        rewards.append(reward)
    assert dones.all()
    for i, (info, expected) in enumerate(zip(infos, plain_infos, strict=True)):
        assert set(info) == {*expected, "episode"}
        assert info["episode"]["l"] == HORIZON
        assert info["episode"]["r"] == pytest.approx(sum(reward[i] for reward in rewards), rel=1e-6)
    assert env.env_is_wrapped(NormalizeReward) == [True] * 3
    env.set_attr("update_running_mean", False)
    assert env.env.env.env.update_running_mean is False
    env.set_attr("energy_weight", 0.5)
    assert batch.energy_weight == 0.5


def test_render_gives_the_arms_pictures_in_one_and_each_alone():
    env = made(2, render_mode="rgb_array", render_width=101, render_height=80)
    env.reset()
    pictures = env.get_images()
    assert [picture.shape for picture in pictures] == [(80, 102, 3)] * 2
    for mine, expected in zip(pictures, env.env.render(), strict=True):
        np.testing.assert_array_equal(mine[:, :101], expected)
    assert pictures[0].std() > 0.0
    np.testing.assert_array_equal(VecNormalize(VecMonitor(env)).render(), np.concatenate(pictures))
    silent = made(2)
    with pytest.warns(UserWarning, match=r"^render_mode must be 'rgb_array' for pictures, got None$"):
        assert silent.get_images() == [None, None]


def test_videos_with_odd_sizes_are_mp4s_that_players_take(tmp_path):
    env = made(2, render_mode="rgb_array", render_width=101, render_height=81)
    env = VecVideoRecorder(VecNormalize(VecMonitor(env)), str(tmp_path), lambda step: step == 0, video_length=4)
    env.reset()
    for action in actions(2, 6):
        env.step(action)
    env.close()
    (video,) = tmp_path.glob("*.mp4")
    shown = subprocess.run([get_ffmpeg_exe(), "-i", str(video)], capture_output=True, text=True, check=False).stderr
    # Two pictures above each other; players decode no other pixels than these.
    assert re.search(r"Video: h264 .*yuv420p.* 102x164", shown), shown


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

"""Data sets of players: whole episodes, each action beside the observation that it answers, stored with their task."""

import numpy as np
import pytest

from agents.evaluation.dataset import FIELDS, record_episodes, write_dataset
from agents.evaluation.players import find_player
from elbow_gym import ElbowArmEnv
from elbow_gym.baselines.policy import load_policy


def test_episodes_are_whole_and_actions_answer_their_observations():
    player = find_player("ppo", 1, arguments={"duration": 0.4})
    policy = load_policy("ppo", elbows=1)
    for episode in record_episodes(player, 3, seed=5):
        assert [len(episode[name]) for name in FIELDS] == [21, 20, 20, 20, 20]
        assert (episode["truncations"] == [False] * 19 + [True]).all()
        assert not episode["terminations"].any()
        np.testing.assert_allclose(policy.predict(episode["observations"][:-1])[0], episode["actions"], atol=1e-6)


def test_episode_i_is_that_of_a_single_environment_under_the_same_actions():
    player = find_player("pd", 2, arguments={"duration": 0.05})
    episode = record_episodes(player, 2, seed=3, noise=0.2)[1]
    env = ElbowArmEnv(**player.settings.arguments)
    np.testing.assert_array_equal(env.reset(seed=4)[0], episode["observations"][0])
    for action, reward, seen in zip(episode["actions"], episode["rewards"], episode["observations"][1:], strict=True):
        observation, paid, *_ = env.step(action)
        np.testing.assert_array_equal(observation, seen)
        assert paid == reward
    quiet = record_episodes(player, 2, seed=3)[1]
    assert np.std(episode["actions"][0] - quiet["actions"][0]) > 0.05 * env.action_space.high.max()


@pytest.mark.parametrize(("episodes", "noise", "name"), [(0, 0.0, "episodes"), (1, -0.1, "noise")])
def test_numbers_out_of_range_are_refused(episodes, noise, name):
    with pytest.raises(ValueError, match=f"^{name} must"):
        record_episodes(find_player("pd", 2), episodes, noise=noise)


@pytest.mark.filterwarnings("ignore")
def test_a_stored_data_set_makes_its_environment_again(tmp_path, monkeypatch):
    pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    player = find_player("ppo", 1, arguments={"duration": 0.4})
    data = write_dataset(player, "elbow_gym/short-v0", record_episodes(player, 3))
    assert (data.total_episodes, data.total_steps) == (3, 60)
    assert data.recover_environment().unwrapped.settings.arguments == player.settings.arguments
    with pytest.raises(ValueError, match=r"^name must be new"):
        write_dataset(player, "elbow_gym/short-v0", record_episodes(player, 3))

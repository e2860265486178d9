"""The recipe of Minari and d3rlpy: episodes on disk, pairs of observation and action, and that it learns."""

import numpy as np
import pytest

from tests.support.recipes import returns_of

pytest.importorskip("minari")
pytest.importorskip("d3rlpy")

from agents.recipes import minari_d3rlpy
from elbow_gym.baselines.policy import load_policy

# Warnings of the libraries are not this project's.
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))


def test_every_action_keeps_the_observation_that_it_answers():
    policy = load_policy("ppo", elbows=2)
    data = minari_d3rlpy.replay_buffer(minari_d3rlpy.data_set(episodes=3, noise=0.0))
    assert [episode.actions.shape for episode in data.episodes] == [(250, 10)] * 3
    for episode in data.episodes:
        assert not episode.terminated
        np.testing.assert_allclose(policy.predict(episode.observations)[0], episode.actions, atol=1e-6)


def test_data_set_of_the_same_name_is_replaced():
    for count in (2, 1):
        data = minari_d3rlpy.data_set(episodes=count)
    assert data.total_episodes == 1


def test_return_after_a_thousand_gradient_steps_is_that_of_an_arm_that_follows_the_circle():
    assert returns_of(minari_d3rlpy.train, 1000)[-1] > -80.0

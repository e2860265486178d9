"""The recipe of skrl: the last observation of a truncated episode, and that it learns."""

import numpy as np
import pytest

from tests.support.recipes import returns_of

pytest.importorskip("skrl")

from agents.recipes import skrl_ppo


def test_value_of_a_truncated_episode_is_that_of_its_last_observation(monkeypatch):
    seen = []

    def record(self, *, next_observations, truncated, infos, **_):
        if truncated.any():
            seen.append((next_observations.numpy().copy(), np.stack(infos["final_obs"])))

    monkeypatch.setattr(skrl_ppo, "NUM_ENVS", 2)
    monkeypatch.setattr(skrl_ppo.PPO, "record_transition", record)
    monkeypatch.setattr(skrl_ppo.PPO, "post_interaction", lambda *_, **__: None)
    skrl_ppo.train(500)
    assert len(seen) == 1
    np.testing.assert_array_equal(*seen[0])


@pytest.mark.slow
def test_return_rises_within_three_updates():
    returns = returns_of(skrl_ppo.train, 48_000)
    assert len(returns) == 3
    assert returns[-1] > returns[0] + 20.0

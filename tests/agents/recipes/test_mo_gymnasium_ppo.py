"""The recipe of MO-Gymnasium and morl-baselines: rewards, ends of episodes, and that it learns."""

import gymnasium as gym
import numpy as np
import pytest

from tests.support.recipes import returns_of

pytest.importorskip("morl_baselines")

from agents.recipes import mo_gymnasium_ppo

# Warnings of the libraries are not this project's.
pytestmark = pytest.mark.filterwarnings("ignore")


def test_returns_are_cut_where_episodes_end_and_watts_are_scaled():
    def batch():
        return gym.make_vec("elbow_gym:mo-ElbowArm-v0", 2, autoreset_mode="SameStep", duration=0.1)

    ours, twin = mo_gymnasium_ppo.Cut(batch()), batch()
    for env in (ours, twin):
        env.reset(seed=0)
    action = np.full((2, 10), 0.1, dtype=np.float32)
    for k in range(5):
        reward, terminated, truncated = ours.step(action)[1:4]
        expected = twin.step(action)[1]
        np.testing.assert_allclose(reward, expected * [1.0, 0.001], rtol=1e-6)
        assert terminated.all() == truncated.all() == (k == 4)


@pytest.mark.slow
def test_return_rises_within_three_updates():
    returns = returns_of(mo_gymnasium_ppo.train, 48_000)
    assert len(returns) == 3
    assert returns[-1] > returns[0] + 20.0

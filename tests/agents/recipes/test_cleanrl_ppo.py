"""CleanRL's form of PPO: advantages by hand, and that it learns."""

import pytest

pytest.importorskip("torch")

import torch

from agents.recipes import cleanrl_ppo
from tests.support.recipes import returns_of


def test_advantages_of_an_episode_that_ends_know_nothing_of_the_next_one():
    gamma, decay = cleanrl_ppo.GAMMA, cleanrl_ppo.LAMBDA
    rewards, values = torch.tensor([[1.0], [2.0], [4.0]]), torch.tensor([[0.5], [0.25], [8.0], [16.0]])
    lasting = torch.tensor([[1.0], [0.0], [1.0]])
    found = cleanrl_ppo.estimate(rewards, values, lasting)[:, 0].tolist()
    last, middle = 4.0 + gamma * 16.0 - 8.0, 2.0 - 0.25
    assert found == pytest.approx([1.0 + gamma * 0.25 - 0.5 + gamma * decay * middle, middle, last])


@pytest.mark.slow
def test_return_rises_within_three_updates():
    returns = returns_of(cleanrl_ppo.train, 48_000)
    assert len(returns) == 3
    assert returns[2] > returns[0] + 20.0

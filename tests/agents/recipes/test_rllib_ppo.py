"""The recipe of RLlib: episodes in both autoreset modes, and that it learns."""

import pytest

from tests.support.recipes import returns_of

pytest.importorskip("ray.rllib")

from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.env.single_agent_env_runner import SingleAgentEnvRunner

from agents.recipes import rllib_ppo

# Warnings of the library are not this project's; it starts processes, which takes long.
pytestmark = [pytest.mark.soak, pytest.mark.filterwarnings("ignore")]


@pytest.mark.parametrize(("mode", "lengths"), [("NextStep", [5, 5, 5]), ("SameStep", [5, 4, 4])])
def test_episodes_keep_their_first_step_in_next_step_alone(mode, lengths):
    arguments = {"duration": 0.1, "autoreset_mode": mode}
    config = (
        PPOConfig()
        .environment("elbow_gym:ElbowArm-v0", env_config=arguments)
        .env_runners(num_envs_per_env_runner=1, gym_env_vectorize_mode="vector_entry_point")
    )
    runner = SingleAgentEnvRunner(config=config)
    episodes = runner.sample(num_episodes=3, random_actions=True)
    runner.stop()
    assert [len(episode) for episode in episodes] == lengths


def test_return_rises_within_three_updates():
    returns = returns_of(rllib_ppo.train, 48_000)
    assert len(returns) == 3
    assert returns[-1] > returns[0] + 10.0

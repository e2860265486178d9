#!/usr/bin/env bash
# Package: ray[rllib] 2.60.0 (with gymnasium 1.2.2, which it pins, and torch 2.13.0).
# Expected: with `gym_env_vectorize_mode="vector_entry_point"` a batch of the user's own runs in the autoreset mode
#   that its metadata and its `autoreset_mode` declare, or is refused.
# Seen: RLlib's env runner takes every batch for one of "NextStep". Of a batch of "SameStep" it stores the first
#   observation of the next episode as the last one of the old (the true one, `final_obs` in the info, is not read),
#   and takes the observation after the next step for the new episode's start: that step's action and reward are
#   dropped. Every episode but the first is one step short. Nothing is said.
# Why it matters: returns are too small or too large by the first reward, values at truncations are those of a fresh
#   start, and an episode of one step vanishes altogether.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
  "ray[rllib]==2.60.0" gymnasium==1.2.2 torch==2.13.0 numpy
"$folder/venv/bin/python" - <<'PYTHON'
import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.env.single_agent_env_runner import SingleAgentEnvRunner


class Counter(gym.Env):
    """Observes 0, 1, 2, 3, is truncated there, and rewards every step with its number: 1, 2, 3."""

    observation_space = gym.spaces.Box(0.0, 9.0, (1,))
    action_space = gym.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        return np.zeros(1, dtype=np.float32), {}

    def step(self, action):
        self.steps += 1
        return np.full(1, self.steps, dtype=np.float32), float(self.steps), False, self.steps == 3, {}


def batch(num_envs, mode):
    return SyncVectorEnv([Counter] * num_envs, autoreset_mode=mode)


for mode in AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP:
    gym.register(f"Counter{mode.value}-v0", Counter, vector_entry_point=lambda num_envs, m=mode: batch(num_envs, m))
    config = (
        PPOConfig()
        .environment(f"Counter{mode.value}-v0")
        .env_runners(num_envs_per_env_runner=1, gym_env_vectorize_mode="vector_entry_point")
    )
    runner = SingleAgentEnvRunner(config=config)
    found = [
        (episode.get_observations()[:, 0].tolist(), episode.get_rewards().tolist())
        for episode in runner.sample(num_episodes=3, random_actions=True)
    ]
    for number, (observations, rewards) in enumerate(found, start=1):
        print(f"{mode.value}, episode {number}: observations {observations}, rewards {rewards}")
    whole = ([0.0, 1.0, 2.0, 3.0], [1.0, 2.0, 3.0])
    if mode is AutoresetMode.NEXT_STEP:
        assert found == [whole] * 3
    else:
        assert found[0] == ([0.0, 1.0, 2.0, 0.0], [1.0, 2.0, 3.0])
        assert found[1] == found[2] == ([1.0, 2.0, 0.0], [2.0, 3.0])
PYTHON

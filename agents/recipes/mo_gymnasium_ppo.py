"""morl-baselines' multi-objective PPO on the native batch of "mo-ElbowArm-v0", by MO-Gymnasium's conventions.

Pinned: morl-baselines 1.3.0, mo-gymnasium 1.3.2, gymnasium 1.4.0, torch 2.13.0.
`python -m agents.recipes.mo_gymnasium_ppo`

`MOPPO` takes the batch unmodified, but cuts its returns at terminations only, and this task only truncates: without
`Cut` they run on over the end of an episode into the next one. `autoreset_mode="SameStep"`, since it learns from every
step.
"""

from __future__ import annotations

import time
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from morl_baselines.single_policy.ser.mo_ppo import MOPPO, MOPPONet

from agents.recipes.race import AfterUpdate, main

NUM_ENVS, PERIODS = 64, 250
"""Arms, and control periods of each between two updates: one episode, so that an update sees all parts of it."""
FRAMES = NUM_ENVS * PERIODS
SCALE = np.array([1.0, 0.001])
"""Scales of the rewards, 1/m and 1/W, so that both objectives are of the same order: one watt is one millimetre."""


class Cut(gym.vector.VectorWrapper):
    """Rewards times `SCALE`, and truncations shown as terminations, so that returns end where episodes do."""

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """One control period of every arm."""
        observation, reward, terminated, truncated, info = self.env.step(actions)
        return observation, (reward * SCALE).astype(np.float32), terminated | truncated, truncated, info


def train(
    steps: int = 1_000_000,
    seed: int = 0,
    after_update: AfterUpdate = lambda *_: False,
    weights: tuple[float, float] = (1.0, 1.0),
) -> MOPPO:
    """Trains morl-baselines' PPO for one weighting of error and power."""
    torch.manual_seed(seed)
    env = Cut(gym.make_vec("elbow_gym:mo-ElbowArm-v0", NUM_ENVS, autoreset_mode="SameStep", start_noise=0.1))
    size, n = env.single_observation_space.shape, env.single_action_space.shape
    networks = MOPPONet(size, n, reward_dim=2, net_arch=[64, 64])
    torch.nn.init.constant_(networks.actor_logstd, -1.5)
    agent = MOPPO(
        0,
        networks,
        np.array(weights, dtype=np.float32),
        env,
        steps_per_iteration=PERIODS,
        num_minibatches=FRAMES // 1000,
        update_epochs=8,
        learning_rate=1e-3,
        gamma=0.97,
        clip_vloss=False,
        device="cpu",
        seed=seed,
    )

    def act(observation: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return networks.actor_mean(torch.from_numpy(observation)).numpy()

    updates, start = -(-steps // FRAMES), time.time()
    for update in range(1, updates + 1):
        agent.train(start, update, updates)
        if after_update(update * FRAMES, act):
            break
    env.close()
    return agent


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(train, 1_000_000)

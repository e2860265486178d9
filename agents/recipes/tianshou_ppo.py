"""Tianshou's PPO on the native batch.

Pinned: tianshou 2.0.1, gymnasium 1.4.0, torch 2.13.0.
`python -m agents.recipes.tianshou_ppo`

The single environment runs unmodified in `DummyVectorEnv`, arm by arm. For the batch Tianshou needs an adapter,
`Batch`, since its vector environments are a class of its own, and reset by themselves the arms that they choose: so
`autoreset_mode` is "Disabled". Truncation is told from termination.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from tianshou.algorithm import PPO
from tianshou.algorithm.algorithm_base import policy_within_training_step
from tianshou.algorithm.modelfree.reinforce import ProbabilisticActorPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Collector, CollectStats, VectorReplayBuffer
from tianshou.env import BaseVectorEnv
from tianshou.utils.net.common import Net
from tianshou.utils.net.continuous import ContinuousActorProbabilistic, ContinuousCritic
from torch.distributions import Independent, Normal

from agents.recipes.race import AfterUpdate, main

NUM_ENVS, PERIODS = 64, 250
"""Arms, and control periods of each between two updates: one episode, so that an update sees all parts of it."""
FRAMES = NUM_ENVS * PERIODS


class Batch(BaseVectorEnv):
    """The native batch, made with `autoreset_mode="Disabled"`, as a vector environment of Tianshou's.

    A step is one of all arms, a reset one of any. Infos are empty dicts.
    """

    def __init__(self, env: gym.vector.VectorEnv) -> None:
        self.batch, self.env_num = env, env.num_envs
        self.is_async = self.is_closed = False
        self.waiting_id: list[int] = []

    def get_env_attr(self, key: str, id: int | Sequence[int] | np.ndarray | None = None) -> list[Any]:
        """Spaces and metadata of one arm, once per arm asked for."""
        name = f"single_{key}" if key.endswith("_space") else key
        return [getattr(self.batch, name)] * len(self._wrap_id(id))

    def reset(self, env_id: Any = None, **kwargs: Any) -> tuple[np.ndarray, np.ndarray]:
        """Starts episodes in some arms, in all by default."""
        chosen = self._wrap_id(env_id)
        mask = np.isin(np.arange(self.env_num), chosen)
        observation, _ = self.batch.reset(options={"reset_mask": mask}, **kwargs)
        return observation[chosen], np.array([{} for _ in chosen])

    def step(self, action: Any, id: Any = None) -> tuple[np.ndarray, ...]:
        """Makes one control period of all arms. Raises ValueError when only some are asked for."""
        if len(self._wrap_id(id)) != self.env_num:
            raise ValueError(f"id must be all {self.env_num} arms, got {id}")
        observation, reward, terminated, truncated, _ = self.batch.step(np.asarray(action))
        return observation, reward, terminated, truncated, np.array([{"env_id": i} for i in range(self.env_num)])

    def close(self) -> None:
        """Closes the batch."""
        self.batch.close()
        self.is_closed = True


def train(steps: int = 1_000_000, seed: int = 0, after_update: AfterUpdate = lambda *_: False) -> PPO:
    """Trains Tianshou's PPO."""
    torch.manual_seed(seed)
    batch = gym.make_vec("elbow_gym:ElbowArm-v0", NUM_ENVS, autoreset_mode="Disabled", start_noise=0.1)
    shape, n = batch.single_observation_space.shape, batch.single_action_space.shape[0]
    nets = [Net(state_shape=shape, hidden_sizes=[64, 64], activation=torch.nn.SiLU) for _ in range(2)]
    actor = ContinuousActorProbabilistic(preprocess_net=nets[0], action_shape=n, unbounded=True)
    torch.nn.init.constant_(actor.sigma_param, -1.5)
    torch.nn.init.orthogonal_(actor.mu.model[-1].weight, 0.01)
    torch.nn.init.zeros_(actor.mu.model[-1].bias)
    policy = ProbabilisticActorPolicy(
        actor=actor,
        dist_fn=lambda outputs: Independent(Normal(*outputs), 1),
        action_space=batch.single_action_space,
        action_scaling=False,
        action_bound_method=None,
    )
    algorithm = PPO(
        policy=policy,
        critic=ContinuousCritic(preprocess_net=nets[1]),
        optim=AdamOptimizerFactory(lr=1e-3, eps=1e-5),
        gamma=0.97,
        gae_lambda=0.95,
        ent_coef=0.0,
        max_grad_norm=0.5,
        max_batchsize=FRAMES,
    )
    collector = Collector[CollectStats](algorithm, Batch(batch), VectorReplayBuffer(FRAMES, NUM_ENVS))
    collector.reset(gym_reset_kwargs={"seed": seed})

    def act(observation: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return actor(observation)[0][0].numpy()

    for done in range(FRAMES, steps + FRAMES, FRAMES):
        with policy_within_training_step(policy):
            collector.collect(n_step=FRAMES)
            algorithm.update(collector.buffer, batch_size=1000, repeat=8)
        collector.reset_buffer(keep_statistics=True)
        if after_update(done, act):
            break
    batch.close()
    return algorithm


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(train, 1_000_000)

"""skrl's PPO on the native batch.

Pinned: skrl 2.1.1, gymnasium 1.4.0, torch 2.13.0.
`python -m agents.recipes.skrl_ppo`

Four things matter:

- `time_limit_bootstrap=True`. Without it skrl's advantages run on over a truncation into the next episode of the same
  arm, and this task only truncates.
- `FinalObservations`, five lines. With the setting above, skrl adds the value of the observation that the step
  returned, which in "SameStep" is the next episode's first one; the last one is in `infos["final_obs"]`.
- `autoreset_mode="SameStep"`. In "NextStep" every episode begins with a step whose action is ignored, and skrl learns
  from it.
- `headless=True`. By default the trainer renders in every step.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import torch
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed
from torch import nn

from agents.recipes.networks import perceptron
from agents.recipes.race import AfterUpdate, main

NUM_ENVS, PERIODS = 64, 250
"""Arms, and control periods of each between two updates: one episode, so that an update sees all parts of it."""


class FinalObservations(PPO):
    """skrl's PPO, which sees the last observation of a truncated episode, not the first one of the next."""

    def record_transition(self, *, next_observations: Any, truncated: Any, infos: Any, **others: Any) -> None:
        """Stores a transition of every arm."""
        over = truncated[:, 0]
        if over.any():
            next_observations = next_observations.clone()
            next_observations[over] = torch.from_numpy(np.stack(infos["final_obs"][over.numpy()]))
        super().record_transition(next_observations=next_observations, truncated=truncated, infos=infos, **others)


class Policy(GaussianMixin, Model):
    """Normal distribution of the actions around a perceptron's output."""

    def __init__(self, **spaces: gym.Space) -> None:
        Model.__init__(self, **spaces)
        GaussianMixin.__init__(self, clip_log_std=False)
        self.net = perceptron(self.num_observations, self.num_actions)
        self.log_std = nn.Parameter(torch.full((self.num_actions,), -1.5))

    def compute(self, inputs: dict, role: str) -> tuple[torch.Tensor, dict]:
        """Mean actions (B, n), and the logarithm of their standard deviation."""
        return self.net(inputs["observations"]), {"log_std": self.log_std}


class Value(DeterministicMixin, Model):
    """Value of an observation."""

    def __init__(self, **spaces: gym.Space) -> None:
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.net = perceptron(self.num_observations, 1)

    def compute(self, inputs: dict, role: str) -> tuple[torch.Tensor, dict]:
        """Values (B, 1)."""
        return self.net(inputs["observations"]), {}


def train(steps: int = 1_000_000, seed: int = 0, after_update: AfterUpdate = lambda *_: False) -> PPO:
    """Trains skrl's PPO."""
    set_seed(seed)
    env = wrap_env(gym.make_vec("elbow_gym:ElbowArm-v0", NUM_ENVS, autoreset_mode="SameStep", start_noise=0.1))
    spaces = {"observation_space": env.observation_space, "action_space": env.action_space}
    models = {"policy": Policy(**spaces), "value": Value(**spaces)}
    cfg = PPO_CFG(
        rollouts=PERIODS,
        learning_epochs=8,
        mini_batches=16,
        discount_factor=0.97,
        learning_rate=1e-3,
        value_loss_scale=0.5,
        value_clip=0.0,
        time_limit_bootstrap=True,
    )
    cfg.experiment.write_interval = cfg.experiment.checkpoint_interval = 0
    agent = FinalObservations(
        models=models, memory=RandomMemory(memory_size=PERIODS, num_envs=NUM_ENVS), cfg=cfg, **spaces
    )
    quiet = {"headless": True, "disable_progressbar": True, "close_environment_at_exit": False}
    trainer = SequentialTrainer(env=env, agents=agent, cfg={"timesteps": PERIODS, **quiet})
    for done in range(PERIODS * NUM_ENVS, steps + PERIODS * NUM_ENVS, PERIODS * NUM_ENVS):
        trainer.train()
        if after_update(done, lambda seen: models["policy"].net(torch.from_numpy(seen)).detach().numpy()):
            break
    env.close()
    return agent


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(train, 1_000_000)

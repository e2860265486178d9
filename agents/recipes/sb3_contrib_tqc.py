"""sb3-contrib's TQC and CrossQ on the native batch.

Pinned: sb3-contrib 2.9.2, stable-baselines3 2.9.2, gymnasium 1.4.0, torch 2.13.0.
`python -m agents.recipes.sb3_contrib_tqc`, or with `--algorithm crossq`

As `sb3_ppo`: through `SB3VecEnv`, so "SameStep". An exploring volt is worth less than stock critics err. Here a volt is
more of an action, since a third of the supply is all that the arm gets in training; rewards are ten times the
environment's, so that TQC's loss is linear past a tenth of it; critics and actor see this project's `Foresight`; and
the policy is the average of the last actors.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import torch
from sb3_contrib import TQC, CrossQ
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from agents.learning.sac.inputs import Foresight
from agents.recipes.race import SETTINGS, AfterUpdate, main
from agents.recipes.sb3_ppo import Joules, environment
from elbow_gym.interface import Interface

NUM_ENVS, GRADIENT_STEPS = 256, 4
"""Arms, and gradient steps that follow each of their control periods."""
FIRST_STEPS = 250 * NUM_ENVS
"""Control periods with random actions before the first gradient step: an episode of each arm."""
VOLTAGE_LIMIT = 8.0
"""Supply voltage in training [V]."""
WEIGHTS = {"tracking_weight": 10.0, "energy_weight": 0.002}
"""Weights of the reward in training, the error's ten times and the energy's twice the environment's."""
ALGORITHMS = {
    "tqc": (TQC, {"tau": 0.02, "top_quantiles_to_drop_per_net": 1}, {"n_quantiles": 10}),
    "crossq": (CrossQ, {}, {}),
}
"""Class, arguments and arguments of the policy by name."""


class View(BaseFeaturesExtractor):
    """`Foresight` as Stable-Baselines3 takes inputs of networks."""

    def __init__(self, space: Any, view: Foresight) -> None:
        super().__init__(space, view.size)
        self._view = view

    def forward(self, observation: torch.Tensor) -> torch.Tensor:
        """Inputs of the networks [-], shape (B, view.size), from observations [-], shape (B, size)."""
        return self._view(observation)


class Averaged(Joules):
    """`Joules` that hands out the average of the last 2000 gradient steps' actors, as one for the full supply."""

    def _on_training_start(self) -> None:
        average = get_ema_multi_avg_fn(1.0 - GRADIENT_STEPS / 2000)
        self._average = AveragedModel(self.model.policy.actor, multi_avg_fn=average)

    def _on_rollout_start(self) -> None:
        self._average.update_parameters(self.model.policy.actor)
        super()._on_rollout_start()

    def _act(self, observation: np.ndarray) -> np.ndarray:
        return self._average.module.predict(observation, deterministic=True)[0] * VOLTAGE_LIMIT / SETTINGS.voltage_limit


def train(
    steps: int = 1_000_000,
    seed: int = 0,
    after_update: AfterUpdate = lambda *_: False,
    algorithm: Literal["tqc", "crossq"] = "tqc",
) -> Any:
    """Trains one of sb3-contrib's algorithms."""
    env = environment(NUM_ENVS, start_noise=0.1, voltage_limit=VOLTAGE_LIMIT, **WEIGHTS)
    env.seed(seed)
    arms = Interface(env.get_attr("unwrapped", 0)[0])
    kind, arguments, policy = ALGORITHMS[algorithm]
    model = kind(
        "MlpPolicy",
        env,
        learning_rate=lambda remaining: 7e-4 * max(remaining, 0.05),
        buffer_size=1000 * NUM_ENVS,
        learning_starts=FIRST_STEPS,
        batch_size=256,
        gamma=0.95,
        train_freq=1,
        gradient_steps=GRADIENT_STEPS,
        ent_coef="auto_0.2",
        policy_kwargs={
            "net_arch": {"pi": [64, 64], "qf": [128, 128]},
            "activation_fn": torch.nn.ReLU,
            "features_extractor_class": View,
            "features_extractor_kwargs": {"view": Foresight(arms.layout, arms.arm, arms.pose)},
            **policy,
        },
        seed=seed,
        device="cpu",
        **arguments,
    )
    return model.learn(steps, callback=Averaged(after_update))


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(train, 1_000_000, tuple(ALGORITHMS))

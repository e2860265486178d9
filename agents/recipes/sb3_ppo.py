"""Stable-Baselines3's PPO on the native batch, with its monitor, normalisation, video and joules in TensorBoard.

Pinned: stable-baselines3 2.9.2, gymnasium 1.4.0, torch 2.13.0, tensorboard 2.21.0.
`python -m agents.recipes.sb3_ppo`

Through `SB3VecEnv`, which takes the batch in the mode "SameStep" alone: Stable-Baselines3 expects the first
observation of the new episode from the step that ends the old one. Truncation is told from termination, so that the
value of the last observation is added. The observations need no normalisation; `VecNormalize` is here for the rewards,
whose running scale it finds. With `norm_obs=True` the policy needs the wrapper's statistics wherever it plays.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize, VecVideoRecorder

from agents.recipes.race import AfterUpdate, main
from elbow_gym.sb3 import SB3VecEnv

NUM_ENVS, PERIODS = 64, 250
"""Arms, and control periods of each between two updates: one episode, so that an update sees all parts of it."""
METERS = ("electrical_energy", "drawn_energy", "tracking_error")
"""Entries of an episode's last info that the monitor keeps, in J, J and m."""


class Joules(BaseCallback):
    """Means of `METERS` over the last episodes in TensorBoard, and the training's end where `after_update` says so."""

    def __init__(self, after_update: AfterUpdate) -> None:
        super().__init__()
        self._after_update = after_update
        self._over = False

    def _on_step(self) -> bool:
        return not self._over

    def _on_rollout_end(self) -> None:
        for name in METERS if self.model.ep_info_buffer else ():
            self.logger.record(f"rollout/{name}", np.mean([episode[name] for episode in self.model.ep_info_buffer]))

    def _on_rollout_start(self) -> None:
        if self.num_timesteps:
            self._over = self._after_update(self.num_timesteps, self._act)

    def _on_training_end(self) -> None:
        if not self._over:
            self._after_update(self.num_timesteps, self._act)

    def _act(self, observation: np.ndarray) -> np.ndarray:
        return self.model.predict(observation, deterministic=True)[0]


def environment(num_envs: int, **arguments: Any) -> VecMonitor:
    """The batch under Stable-Baselines3's monitor. `arguments` are those of `ElbowArmVectorEnv`."""
    batch = gym.make_vec("elbow_gym:ElbowArm-v0", num_envs, autoreset_mode="SameStep", **arguments)
    return VecMonitor(SB3VecEnv(batch), info_keywords=METERS)


def train(
    steps: int = 1_000_000,
    seed: int = 0,
    after_update: AfterUpdate = lambda *_: False,
    log: Path | None = None,
) -> PPO:
    """Trains Stable-Baselines3's PPO, with logs for TensorBoard in a folder."""
    env = VecNormalize(environment(NUM_ENVS, start_noise=0.1), norm_obs=False, gamma=0.97)
    env.seed(seed)
    model = PPO(
        "MlpPolicy",
        env,
        learning_rate=lambda remaining: 1e-3 * max(remaining, 0.05),
        n_steps=PERIODS,
        batch_size=1000,
        n_epochs=8,
        gamma=0.97,
        gae_lambda=0.95,
        policy_kwargs={
            "net_arch": [64, 64],
            "activation_fn": torch.nn.SiLU,
            "log_std_init": -1.5,
            "optimizer_kwargs": {"fused": True},
        },
        tensorboard_log=None if log is None else str(log),
        seed=seed,
        device="cpu",
    )
    return model.learn(steps, callback=Joules(after_update))


def film(model: PPO, folder: Path, periods: int = 250, **arguments: Any) -> Sequence[Path]:
    """Videos (MP4) of a model's first control periods, in a folder."""
    env = environment(2, render_mode="rgb_array", **arguments)
    video = VecVideoRecorder(env, str(folder), record_video_trigger=lambda step: step == 0, video_length=periods)
    observation = video.reset()
    for _ in range(periods + 1):
        observation = video.step(model.predict(observation, deterministic=True)[0])[0]
    video.close()
    return sorted(folder.glob("*.mp4"))


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(train, 1_000_000)

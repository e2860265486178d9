"""Trains SB3 agents on the batched environment; progress, TensorBoard, checkpoints, and Ctrl-C keeps what is there."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elbow_gym.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

if TYPE_CHECKING:
    from agents.policy import Policy


@dataclass(frozen=True, kw_only=True)
class PPOSettings:
    """Proximal policy optimisation: SB3's settings, chosen for this arm."""

    total_timesteps: int = 1_500_000
    """Control periods in all."""
    num_envs: int = 32
    """Arms side by side."""
    n_steps: int = 128
    """Control periods per arm and update."""
    batch_size: int = 1024
    n_epochs: int = 10
    learning_rate: float = 5e-4
    """At the start; falls linearly to a twentieth."""
    gamma: float = 0.97
    """Discount per control period."""
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    log_std_init: float = -1.5
    hidden: tuple[int, ...] = (128, 128)
    """Widths of the tanh layers of actor and critic."""


def train_ppo(
    settings: Settings,
    ppo: PPOSettings,
    seed: int,
    folder: Path,
    checkpoint_every: int = 250_000,
    minutes: float | None = None,
) -> Policy:
    """Trains PPO and returns the policy with the best return at the periodic evaluations.

    Writes `best.safetensors` and `best.json` each time the evaluation improves, `checkpoint.zip` (SB3's own format)
    every `checkpoint_every` control periods, and TensorBoard logs, all under `folder`. Ctrl-C ends the training and
    keeps the best policy so far.

    Args:
        settings: the environment.
        ppo: the algorithm's settings.
        seed: of the networks, the sampling and the arms.
        folder: where everything goes.
        checkpoint_every: control periods between two evaluations.
        minutes: the training ends after so many, evaluations counted in; no limit when None.
    """
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecMonitor

    from agents.keeper import Keeper
    from elbow_gym.sb3 import SB3VecEnv

    # Small networks lose more by handing work between threads than they gain.
    torch.set_num_threads(1)
    env = ElbowArmVectorEnv(ppo.num_envs, **settings.arguments, autoreset_mode="SameStep")
    monitored = VecMonitor(SB3VecEnv(env), info_keywords=("electrical_energy", "tracking_error"))
    model = PPO(
        "MlpPolicy",
        monitored,
        n_steps=ppo.n_steps,
        batch_size=ppo.batch_size,
        n_epochs=ppo.n_epochs,
        gamma=ppo.gamma,
        gae_lambda=ppo.gae_lambda,
        clip_range=ppo.clip_range,
        learning_rate=_falling(ppo.learning_rate),
        policy_kwargs={
            "net_arch": list(ppo.hidden),
            "log_std_init": ppo.log_std_init,
            "activation_fn": torch.nn.Tanh,
        },
        tensorboard_log=str(folder / "tensorboard"),
        seed=seed,
        device="cpu",
    )
    keeper = Keeper(settings, ppo, seed, folder, checkpoint_every, minutes)
    try:
        model.learn(ppo.total_timesteps, callback=keeper)
    except KeyboardInterrupt:
        print("interrupted; keeping the best policy so far", file=sys.stderr)
    keeper.finish(model)
    return keeper.best


def _falling(start: float) -> Any:
    return lambda remaining: start * max(remaining, 0.05)

"""Settings of proximal policy optimisation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.learning.settings import Activation, AlgorithmSettings


@dataclass(frozen=True, kw_only=True)
class PPOSettings(AlgorithmSettings):
    """Proximal policy optimisation, chosen for this arm."""

    total_timesteps: int = 2_500_000
    num_envs: int = 128
    learning_rate: float = 7e-4
    gamma: float = 0.98
    hidden: tuple[int, ...] = (64, 64)
    activation: Activation = "silu"
    n_steps: int = 32
    """Control periods per arm and update."""
    batch_size: int = 1024
    """Samples per gradient step."""
    n_epochs: int = 6
    """Passes over an update's samples."""
    gae_lambda: float = 0.95
    """Of the generalised advantage estimate."""
    clip_range: float = 0.2
    """Largest change of an action's probability ratio."""
    ent_coef: float = 0.0
    """Weight of the entropy bonus."""
    vf_coef: float = 0.5
    """Weight of the value function's loss."""
    max_grad_norm: float = 0.5
    """Gradients are clipped here."""
    normalize_advantage: bool = True
    """Per batch."""
    adam_epsilon: float = 1e-5
    """Adam's: gradients well below it move little."""
    target_kl: float | None = None
    """An update ends early past this divergence; never when None."""
    log_std_init: float = -1.5
    """Natural logarithm of the actions' first standard deviation, in units of the supply voltage."""
    log_std_final: float | None = -3.5
    """What it falls to, linearly over the training; learned when None. Learned, it falls as fast as noise costs power,
    before the posture has been found."""

    def follow_plan(self, model: Any, done: float) -> None:
        """The actions' log_std is linear from `log_std_init` to `log_std_final`, if there is one."""
        if self.log_std_final is not None:
            log_std = self.log_std_init + (self.log_std_final - self.log_std_init) * min(1.0, done)
            model.policy.log_std.requires_grad_(False)
            model.policy.log_std.fill_(log_std)

    @property
    def model_class(self) -> Any:
        """Stable-Baselines3's PPO."""
        from stable_baselines3 import PPO

        return PPO

    def model(self, env: Any, seed: int, log: Path) -> Any:
        """Stable-Baselines3's PPO."""
        arguments = self._common(env, seed, log, "vf")
        arguments["policy_kwargs"]["log_std_init"] = self.log_std_init
        arguments["policy_kwargs"]["optimizer_kwargs"]["eps"] = self.adam_epsilon
        own = ("n_steps", "batch_size", "n_epochs", "gae_lambda", "clip_range", "ent_coef", "vf_coef", "max_grad_norm")
        own += ("normalize_advantage", "target_kl")
        return self.model_class(**arguments, **{name: getattr(self, name) for name in own})

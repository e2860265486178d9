"""Settings of proximal policy optimisation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from agents.learning.settings import Activation, AlgorithmSettings, check_counts, check_shares


@dataclass(frozen=True, kw_only=True)
class PPOSettings(AlgorithmSettings):
    """Settings of proximal policy optimisation (PPO), found for this arm."""

    total_timesteps: int = 2_500_000
    num_envs: int = 128
    learning_rate: float = 7e-4
    gamma: float = 0.98
    hidden: tuple[int, ...] = (64, 64)
    activation: Activation = "silu"
    n_steps: int = 32
    """Time between two updates [control periods], counted on each arm."""
    batch_size: int = 1024
    """Number of samples in each gradient step."""
    n_epochs: int = 6
    """Number of passes over the samples of an update."""
    gae_lambda: float = 0.95
    """Decay of the generalised advantage estimate per control period [-], in (0, 1]."""
    clip_range: float = 0.2
    """Largest change of an action's probability ratio that an update gains by [-]."""
    ent_coef: float = 0.0
    """Weight of the entropy bonus in the loss [-]."""
    vf_coef: float = 0.5
    """Weight of the value function's squared error in the loss [-]."""
    max_grad_norm: float = 0.5
    """Largest norm of a gradient [-]; longer ones are scaled down to it."""
    normalize_advantage: bool = True
    """Whether the advantages of each batch are scaled to mean 0 and standard deviation 1."""
    adam_epsilon: float = 1e-5
    """Adam's epsilon [-]; parameters whose gradients are well below it move little."""
    target_kl: float | None = None
    """Kullback-Leibler divergence past which an update ends early [nat]; never when None."""
    log_std_init: float = -1.5
    """Natural logarithm of the actions' standard deviation at the start, in units of the supply voltage."""
    log_std_final: float | None = -3.5
    """Natural logarithm of the actions' standard deviation at the end, approached linearly; learned when None.
    A learned deviation falls as fast as noise costs power, before the posture has been found."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_counts(self, "n_steps", "batch_size", "n_epochs")
        check_shares(self, "gae_lambda")

    def follow_plan(self, model: Any, done: float) -> None:
        """Sets the actions' log_std, linear from `log_std_init` to `log_std_final`, unless the latter is None."""
        if self.log_std_final is not None:
            log_std = self.log_std_init + (self.log_std_final - self.log_std_init) * min(1.0, done)
            model.policy.log_std.requires_grad_(False)
            model.policy.log_std.fill_(log_std)

    @property
    def model_class(self) -> Any:
        """Class of Stable-Baselines3's PPO with its gradient in closed form."""
        from agents.learning.ppo.agent import PPO

        return PPO

    def model(self, env: Any, seed: int, log: Path) -> Any:
        """PPO on the CPU. Arguments of `AlgorithmSettings.model`."""
        arguments = self._common(env, seed, log, "vf")
        arguments["policy_kwargs"]["log_std_init"] = self.log_std_init
        arguments["policy_kwargs"]["optimizer_kwargs"]["eps"] = self.adam_epsilon
        own = ("n_steps", "batch_size", "n_epochs", "gae_lambda", "clip_range", "ent_coef", "vf_coef", "max_grad_norm")
        own += ("normalize_advantage", "target_kl")
        return self.model_class(**arguments, **{name: getattr(self, name) for name in own})

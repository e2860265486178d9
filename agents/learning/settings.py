"""What the settings of all learning algorithms share."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

FLOOR = 0.05
"""A falling learning rate ends at this share of its start."""

Activation = Literal["tanh", "relu", "elu", "silu"]
Start = Literal["paper", "on_target"]


@dataclass(frozen=True)
class Falling:
    """A learning rate that falls linearly with the training to `FLOOR` of its start."""

    start: float

    def __call__(self, remaining: float) -> float:
        """The rate when this share of the training remains."""
        return self.start * max(remaining, FLOOR)


@dataclass(frozen=True, kw_only=True)
class AlgorithmSettings(ABC):
    """What all algorithms have."""

    total_timesteps: int
    """Control periods in all."""
    num_envs: int
    """Arms side by side."""
    learning_rate: float
    """At the start."""
    falling: bool = True
    """Whether the learning rate falls linearly to a twentieth."""
    gamma: float
    """Discount per control period."""
    hidden: tuple[int, ...]
    """Widths of the actor's layers."""
    activation: Activation
    """Between the layers."""
    critic_hidden: tuple[int, ...] | None = None
    """Widths of the critic's layers; the actor's when None."""
    use_sde: bool = False
    """Generalised state-dependent exploration instead of independent noise."""
    sde_sample_freq: int = -1
    """Control periods between two draws of its noise matrix; once per rollout when -1."""
    start_noise: float | None = None
    """Of the start pose while it trains [rad]; the environment's own when None. Evaluations keep the environment's."""
    start: Start | None = None
    """Where episodes start while it trains; as in the environment when None."""
    first_energy_share: float = 1.0
    """Multiple of the reward's energy weight that the training starts with. Below one the noise on the voltages, which
    costs power, does not end exploration too early; above one the cheap postures are found before the precise ones."""
    energy_share_until: float = 0.5
    """Share of the training after which the weight, changing linearly, stays what it is."""
    energy_share_final: float = 1.0
    """Multiple that it ends with. Above one the training gives away some of the return for less energy; evaluations,
    and with them which policy is the best, count the reward's own weight."""
    evaluate_every: int = 50_000
    """Control periods between two evaluations."""

    def __post_init__(self) -> None:
        if not 0.0 < self.energy_share_until <= 1.0:
            raise ValueError(f"energy_share_until must lie in (0, 1], got {self.energy_share_until}")
        for name in ("first_energy_share", "energy_share_final"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} must be at least 0: power must not pay, got {getattr(self, name)}")

    @property
    def log_interval(self) -> int:
        """Rollouts between two entries in TensorBoard."""
        return 1

    def energy_share(self, done: float) -> float:
        """Multiple of the energy weight when this share of the training is done."""
        change = self.energy_share_final - self.first_energy_share
        return self.first_energy_share + change * min(1.0, done / self.energy_share_until)

    def follow_plan(self, model: Any, done: float) -> None:
        """Sets what follows a plan, such as how widely the model explores, when this share of the training is done."""
        del model, done

    def training_arguments(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """The environment's arguments for the training, from those of the evaluation."""
        own = {"start_noise": self.start_noise, "start": self.start}
        return {**arguments, **{name: value for name, value in own.items() if value is not None}}

    @property
    @abstractmethod
    def model_class(self) -> Any:
        """Stable-Baselines3's class."""

    @abstractmethod
    def model(self, env: Any, seed: int, log: Path) -> Any:
        """Stable-Baselines3's model on the CPU.

        Args:
            env: the `VecEnv` that it trains in.
            seed: of the networks and the sampling.
            log: folder for TensorBoard.
        """

    def _common(self, env: Any, seed: int, log: Path, critic: str) -> dict[str, Any]:
        import torch

        kinds = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU, "elu": torch.nn.ELU, "silu": torch.nn.SiLU}
        widths = self.hidden if self.critic_hidden is None else self.critic_hidden
        return {
            "policy": "MlpPolicy",
            "env": env,
            "learning_rate": Falling(self.learning_rate) if self.falling else self.learning_rate,
            "gamma": self.gamma,
            "use_sde": self.use_sde,
            "sde_sample_freq": self.sde_sample_freq,
            "policy_kwargs": {
                "net_arch": {"pi": list(self.hidden), critic: list(widths)},
                "activation_fn": kinds[self.activation],
                "optimizer_kwargs": {"fused": True},
            },
            "tensorboard_log": str(log),
            "seed": seed,
            "device": "cpu",
        }

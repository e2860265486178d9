"""Settings that all learning algorithms have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral
from pathlib import Path
from typing import Any, Literal

FLOOR = 0.05
"""Share of its start that a falling learning rate ends at [-]."""

Activation = Literal["tanh", "relu", "elu", "silu"]
Start = Literal["paper", "on_target"]


@dataclass(frozen=True)
class Falling:
    """Learning rate that falls linearly over the training to `FLOOR` of its start."""

    start: float
    """Learning rate at the start [-]."""

    def __call__(self, remaining: float) -> float:
        """Learning rate when this share of the training remains [-]."""
        return self.start * max(remaining, FLOOR)


# `--help` keeps the line breaks of these docstrings: every line is a sentence.
@dataclass(frozen=True, kw_only=True)
class AlgorithmSettings(ABC):
    """Settings of any learning algorithm. Raises ValueError naming the argument, the rule and the value."""

    total_timesteps: int
    """Length of the training [control periods], summed over all arms."""
    num_envs: int
    """Number of arms that are simulated side by side."""
    learning_rate: float
    """Learning rate at the start of the training [-]."""
    falling: bool = True
    """Whether the learning rate falls linearly to a twentieth of its start."""
    gamma: float
    """Discount factor per control period [-], in (0, 1]."""
    hidden: tuple[int, ...]
    """Number of units in each hidden layer of the actor."""
    activation: Activation
    """Activation function after each hidden layer."""
    critic_hidden: tuple[int, ...] | None = None
    """Number of units in each hidden layer of the critic; the actor's when None."""
    use_sde: bool = False
    """Whether exploration noise is a function of the state (gSDE) instead of independent in every control period."""
    sde_sample_freq: int = -1
    """Time between two draws of the state-dependent noise [control periods]; one draw per rollout when -1."""
    start_noise: float | None = None
    """Standard deviation of the start pose in training [rad]; the environment's when None.
    Evaluations use the environment's."""
    start: Start | None = None
    """Start of the episodes in training; the environment's when None."""
    first_energy_share: float = 1.0
    """Weight of energy at the start of the training, as a multiple of the environment's energy_weight [-].
    Below 1, exploration, whose noise costs power, does not end too early.
    Above 1, cheap postures are found before precise ones."""
    energy_share_until: float = 0.5
    """Share of the training during which the weight of energy changes, linearly [-], in (0, 1]."""
    energy_share_final: float = 1.0
    """Weight of energy at the end of the training, as a multiple of the environment's energy_weight [-].
    Above 1, the training gives up some return for less energy.
    Evaluations, which choose the best policy, use the environment's."""
    evaluate_every: int = 50_000
    """Time between two evaluations [control periods], summed over all arms."""

    def __post_init__(self) -> None:
        check_counts(self, "total_timesteps", "num_envs", "evaluate_every", "hidden", "critic_hidden")
        check_shares(self, "gamma", "energy_share_until")
        if not self.learning_rate > 0.0:
            raise ValueError(f"learning_rate must be positive, got {self.learning_rate}")
        if self.start_noise is not None and not self.start_noise >= 0.0:
            raise ValueError(f"start_noise must not be negative, got {self.start_noise}")
        for name in ("first_energy_share", "energy_share_final"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} must be at least 0: power must not pay, got {getattr(self, name)}")

    @property
    def log_interval(self) -> int:
        """Number of rollouts between two entries in TensorBoard."""
        return 1

    def energy_share(self, done: float) -> float:
        """Weight of energy when a share of the training is done, as a multiple of the environment's [-]."""
        change = self.energy_share_final - self.first_energy_share
        return self.first_energy_share + change * min(1.0, done / self.energy_share_until)

    def follow_plan(self, model: Any, done: float) -> None:
        """Sets quantities of the model that change by a plan, such as its exploration.

        Args:
            model: model of Stable-Baselines3.
            done: share of the training that is done [-].
        """
        del model, done

    def training_arguments(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Arguments of the environment in training, from those of the evaluation."""
        own = {"start_noise": self.start_noise, "start": self.start}
        return {**arguments, **{name: value for name, value in own.items() if value is not None}}

    @property
    @abstractmethod
    def model_class(self) -> Any:
        """Class of Stable-Baselines3's model."""

    @abstractmethod
    def model(self, env: Any, seed: int, log: Path) -> Any:
        """Stable-Baselines3's model on the CPU.

        Args:
            env: the `VecEnv` that it trains in.
            seed: seed of the networks and the sampling.
            log: folder for TensorBoard.
        """

    def _common(self, env: Any, seed: int, log: Path, critic: str) -> dict[str, Any]:
        import torch

        from agents.learning.flat_adam import FlatAdam

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
                "optimizer_class": FlatAdam,
                "optimizer_kwargs": {},
            },
            "tensorboard_log": str(log),
            "seed": seed,
            "device": "cpu",
        }


def check_counts(settings: Any, *names: str) -> None:
    """ValueError naming the first of the fields that is not a positive integer, or a tuple of some, or None."""
    for name in names:
        value = getattr(settings, name)
        if isinstance(value, tuple):
            if not value or not all(map(_is_count, value)):
                raise ValueError(f"{name} must be positive integers, got {value}")
        elif value is not None and not _is_count(value):
            raise ValueError(f"{name} must be a positive integer, got {value!r}")


def _is_count(value: object) -> bool:
    return isinstance(value, Integral) and value >= 1


def check_shares(settings: Any, *names: str) -> None:
    """ValueError naming the first of the fields that does not lie in (0, 1]."""
    for name in names:
        if not 0.0 < getattr(settings, name) <= 1.0:
            raise ValueError(f"{name} must lie in (0, 1], got {getattr(settings, name)}")

"""Settings of the learning algorithms, one frozen dataclass each."""

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
    """Share of the training after which the weight, changing linearly, is the reward's own."""
    evaluate_every: int = 50_000
    """Control periods between two evaluations."""

    def __post_init__(self) -> None:
        if not 0.0 < self.energy_share_until <= 1.0:
            raise ValueError(f"energy_share_until must lie in (0, 1], got {self.energy_share_until}")

    @property
    def log_interval(self) -> int:
        """Rollouts between two entries in TensorBoard."""
        return 1

    def energy_share(self, done: float) -> float:
        """Multiple of the energy weight when this share of the training is done."""
        return self.first_energy_share + (1.0 - self.first_energy_share) * min(1.0, done / self.energy_share_until)

    def explore(self, model: Any, done: float) -> None:
        """Sets how widely the model explores when this share of the training is done, where that follows a plan."""
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

    def explore(self, model: Any, done: float) -> None:
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


@dataclass(frozen=True, kw_only=True)
class SACSettings(AlgorithmSettings):
    """Soft actor-critic, chosen for this arm.

    Stock settings start with uniform voltages up to 24 V, which fling the arm about: here the first data come from a
    controller that works, and the first actor imitates it, or both from a narrow actor.
    """

    total_timesteps: int = 5_600_000
    num_envs: int = 512
    learning_rate: float = 7e-4
    gamma: float = 0.95
    activation: Activation = "relu"
    evaluate_every: int = 200_000
    hidden: tuple[int, ...] = (64, 64)
    critic_hidden: tuple[int, ...] | None = (128, 128)
    buffer_size: int = 1_000_000
    """Control periods remembered, of all arms together."""
    batch_size: int = 256
    """Samples per gradient step."""
    train_freq: int = 1
    """Control periods of every arm between two rounds of gradient steps."""
    gradient_steps: int = 4
    """Per round; -1 for as many as control periods were collected."""
    huber_delta: float | None = 0.1
    """Temporal-difference error [return] past which the critics' loss is linear; squared throughout when None."""
    tau: float = 0.005
    """Share by which the target critic follows."""
    actor_rate: float = 0.2
    """The actor's learning rate over the critics'."""
    center_tau: float = 0.002
    """Share by which the centre of the critics' quadratic form follows the actor."""
    critic_head_start: int = 1500
    """Gradient steps of the critics before the actor's first."""
    proximity: float = 0.0
    """Weight of half the squared departure of the actor's mean from the centre, in the actor's loss."""
    ent_coef: str = "auto_0.02"
    """Weight of the entropy: a number, or "auto" or "auto_START" to have it learned."""
    target_entropy: float | None = -12.0
    """What a learned weight aims at [nat]; minus the number of joints when None."""
    target_entropy_final: float | None = -30.0
    """What it falls to, linearly over the training; it stays when None. Under wide noise a miss of millimetres costs
    next to nothing; under narrow noise critics do not learn what an action is worth."""
    log_std_init: float = -2.0
    """Natural logarithm of the actor's first spread, before the squashing."""
    learning_starts: int = 256_000
    """Control periods of `warm_start` data, of all arms together, before the first gradient step: two episodes."""
    warm_start: Literal["uniform", "actor", "pd"] = "pd"
    """Where they come from: uniform voltages, the untrained narrow actor, or computed torque with noise, which is the
    PD with the model's feed-forward and, unlike the paper's, bears being read at 50 Hz."""
    warm_start_noise: float = 0.1
    """Standard deviation of that noise, in units of the supply voltage."""
    imitation_steps: int = 6000
    """Gradient steps in which the first actor learns what computed torque did, before any of the critics'; none where
    the data come from elsewhere."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.target_entropy_final is not None and self.target_entropy is None:
            raise ValueError("target_entropy must be a number where there is a target_entropy_final, got None")

    def explore(self, model: Any, done: float) -> None:
        """The entropy aimed at is linear from `target_entropy` to `target_entropy_final`, if there is one."""
        if self.target_entropy is not None and self.target_entropy_final is not None:
            fall = self.target_entropy_final - self.target_entropy
            model.target_entropy = self.target_entropy + fall * min(1.0, done)

    @property
    def log_interval(self) -> int:
        """Episodes between two entries in TensorBoard: one entry whenever all arms have ended theirs."""
        return self.num_envs

    @property
    def model_class(self) -> Any:
        """Stable-Baselines3's SAC with quadratic critics."""
        from agents.sac import SAC

        return SAC

    def model(self, env: Any, seed: int, log: Path) -> Any:
        """The SAC; `agents.warm_start` fills its replay buffer."""
        import torch

        from agents.foresight import Foresight

        arguments = self._common(env, seed, log, "qf")
        # Clipped means would need an actor of another kind in the bundles.
        arguments["policy_kwargs"] |= {"log_std_init": self.log_std_init, "clip_mean": 0.0}
        episodes = env.get_attr("episodes", 0)[0]
        arguments["policy_kwargs"]["view"] = Foresight(episodes.layout, episodes.arm, episodes.pose)
        own = ("buffer_size", "batch_size", "train_freq", "gradient_steps", "tau")
        own += ("huber_delta", "actor_rate", "center_tau", "critic_head_start", "proximity")
        model = self.model_class(
            **arguments,
            **{name: getattr(self, name) for name in own},
            ent_coef=self.ent_coef if self.ent_coef.startswith("auto") else float(self.ent_coef),
            target_entropy="auto" if self.target_entropy is None else self.target_entropy,
            learning_starts=self.learning_starts if self.warm_start == "uniform" else 0,
        )
        if not self.use_sde:
            with torch.no_grad():
                model.actor.log_std.weight.mul_(0.01)
                model.actor.log_std.bias.fill_(self.log_std_init)
        with torch.no_grad():
            model.actor.mu.weight.mul_(0.01)
            model.actor.mu.bias.zero_()
        return model

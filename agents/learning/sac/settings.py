"""Settings of soft actor-critic."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from agents.learning.settings import Activation, AlgorithmSettings, check_counts, check_shares


@dataclass(frozen=True, kw_only=True)
class SACSettings(AlgorithmSettings):
    """Settings of soft actor-critic (SAC) with quadratic critics, found for this arm.

    Stock settings start with uniform voltages up to 24 V, which fling the arm about. Here the first data come from a
    controller that works, and the actor imitates it first; or both come from an actor with narrow noise.
    """

    total_timesteps: int = 5_600_000
    num_envs: int = 512
    learning_rate: float = 7e-4
    gamma: float = 0.97
    activation: Activation = "relu"
    evaluate_every: int = 200_000
    hidden: tuple[int, ...] = (64, 64)
    critic_hidden: tuple[int, ...] | None = (128, 128)
    buffer_size: int = 1_000_000
    """Size of the replay buffer [control periods], summed over all arms."""
    batch_size: int = 1024
    """Number of samples in each gradient step.
    A quarter of them left the critics too ignorant for the actor's first steps: one elbow ended in a fall."""
    train_freq: int = 1
    """Time between two rounds of gradient steps [control periods], counted on each arm."""
    gradient_steps: int = 4
    """Number of gradient steps in each round; as many as control periods were collected when -1."""
    huber_delta: float | None = 0.1
    """Temporal-difference error past which the critics' loss is linear [return]; squared throughout when None."""
    tau: float = 0.005
    """Share of the way to the critics that the target critics go in each gradient step [-]."""
    actor_rate: float = 0.2
    """Learning rate of the actor as a multiple of learning_rate, which is the critics' [-]."""
    center_tau: float = 0.002
    """Share of the way to the actor that the centre of the critics' quadratic form goes in each gradient step [-]."""
    average_tau: float = 0.0005
    """Share of the way to the actor that the average of the actors goes in each gradient step [-].
    The average is the policy; with 1 it is the last actor."""
    critic_head_start: int = 1500
    """Number of gradient steps of the critics before the actor's first."""
    proximity: float = 0.0
    """Weight of half the squared distance between the actor's mean and the centre, in the actor's loss [return]."""
    first_proximity: float | None = None
    """Value of proximity at the start of the training [return]; constant when None.
    A high one keeps critics that know little yet from moving the actor far."""
    proximity_until: float = 0.5
    """Share of the training during which proximity falls from first_proximity, geometrically [-], in (0, 1]."""
    ent_coef: str = "auto_0.02"
    """Weight of the entropy [return/nat]: a number, or "auto" or "auto_START" for one that is learned."""
    target_entropy: float | None = -12.0
    """Entropy at which a learned weight aims [nat]; minus the number of joints when None."""
    target_entropy_final: float | None = -30.0
    """Entropy aimed at when the training ends, approached linearly [nat]; target_entropy throughout when None.
    Under wide noise, missing by millimetres costs next to nothing.
    Under narrow noise, critics do not learn what an action is worth."""
    log_std_init: float = -2.0
    """Natural logarithm of the actions' standard deviation at the start, before the squashing [-]."""
    learning_starts: int = 256_000
    """Length of the data from warm_start before the first gradient step [control periods], summed over all arms."""
    warm_start: Literal["uniform", "actor", "pd"] = "pd"
    """Source of the first data: uniform voltages, the untrained actor with its narrow noise, or computed torque.
    Computed torque is the PD with the model's feed-forward, with noise; it tolerates a rate of 50 Hz."""
    warm_start_noise: float = 0.1
    """Standard deviation of the noise on computed torque's actions, in units of the supply voltage."""
    imitation_steps: int = 6000
    """Number of gradient steps in which the actor first imitates computed torque; none with another warm_start."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_counts(self, "buffer_size", "batch_size", "train_freq")
        check_shares(self, "tau", "center_tau", "average_tau", "proximity_until")
        if self.target_entropy_final is not None and self.target_entropy is None:
            raise ValueError("target_entropy must be a number where there is a target_entropy_final, got None")
        if self.first_proximity is not None and not min(self.first_proximity, self.proximity) > 0.0:
            both = (self.first_proximity, self.proximity)
            raise ValueError(f"first_proximity and proximity must be positive for one to fall to the other, got {both}")

    def follow_plan(self, model: Any, done: float) -> None:
        """Sets the entropy aimed at and the proximity, where they change over the training.

        The entropy is linear from `target_entropy` to `target_entropy_final`. The proximity is geometric from
        `first_proximity` to `proximity`.
        """
        if self.first_proximity is not None:
            left = max(0.0, 1.0 - done / self.proximity_until)
            model.proximity = self.proximity * (self.first_proximity / self.proximity) ** left
        if self.target_entropy is not None and self.target_entropy_final is not None:
            fall = self.target_entropy_final - self.target_entropy
            model.target_entropy = self.target_entropy + fall * min(1.0, done)

    @property
    def log_interval(self) -> int:
        """Number of episodes between two entries in TensorBoard: one entry whenever all arms have ended theirs."""
        return self.num_envs

    @property
    def model_class(self) -> Any:
        """Class of Stable-Baselines3's SAC with quadratic critics."""
        from agents.learning.sac.agent import SAC

        return SAC

    def model(self, env: Any, seed: int, log: Path) -> Any:
        """SAC with quadratic critics on the CPU, its replay buffer empty. Arguments of `AlgorithmSettings.model`."""
        import torch

        from agents.learning.sac.inputs import Foresight
        from elbow_gym.interface import Interface

        arguments = self._common(env, seed, log, "qf")
        # Clipped means would need an actor of another kind in the bundles.
        arguments["policy_kwargs"] |= {"log_std_init": self.log_std_init, "clip_mean": 0.0}
        interface = Interface(env.get_attr("unwrapped", 0)[0])
        arguments["policy_kwargs"]["view"] = Foresight(interface.layout, interface.arm, interface.pose)
        own = ("buffer_size", "batch_size", "train_freq", "gradient_steps", "tau")
        own += ("huber_delta", "actor_rate", "center_tau", "average_tau", "critic_head_start", "proximity")
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

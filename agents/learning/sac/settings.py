"""Settings of soft actor-critic."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from agents.learning.settings import Activation, AlgorithmSettings


@dataclass(frozen=True, kw_only=True)
class SACSettings(AlgorithmSettings):
    """Soft actor-critic, chosen for this arm.

    Stock settings start with uniform voltages up to 24 V, which fling the arm about: here the first data come from a
    controller that works, and the first actor imitates it, or both from a narrow actor.
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
    """Control periods remembered, of all arms together."""
    batch_size: int = 1024
    """Samples per gradient step. With a quarter of them the critics know too little of the actor's first steps: with
    one elbow they ended in a fall (a return of -742 instead of -113)."""
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
    average_tau: float = 0.0005
    """Share by which the average of the actors, which is the policy, follows the actor; 1 for the last actor itself."""
    critic_head_start: int = 1500
    """Gradient steps of the critics before the actor's first."""
    proximity: float = 0.0
    """Weight of half the squared departure of the actor's mean from the centre, in the actor's loss."""
    first_proximity: float | None = None
    """What `proximity` starts at, if it falls: critics that know little yet must not move the actor far."""
    proximity_until: float = 0.5
    """Share of the training after which `proximity`, falling geometrically, is its own."""
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
        if self.first_proximity is not None and not min(self.first_proximity, self.proximity) > 0.0:
            both = (self.first_proximity, self.proximity)
            raise ValueError(f"first_proximity and proximity must be positive for one to fall to the other, got {both}")
        if not 0.0 < self.proximity_until <= 1.0:
            raise ValueError(f"proximity_until must lie in (0, 1], got {self.proximity_until}")

    def follow_plan(self, model: Any, done: float) -> None:
        """The entropy aimed at is linear from `target_entropy` to `target_entropy_final`, if there is one.

        The proximity falls geometrically from `first_proximity`, if there is one.
        """
        if self.first_proximity is not None:
            left = max(0.0, 1.0 - done / self.proximity_until)
            model.proximity = self.proximity * (self.first_proximity / self.proximity) ** left
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
        from agents.learning.sac.agent import SAC

        return SAC

    def model(self, env: Any, seed: int, log: Path) -> Any:
        """The SAC; `agents.learning.warm_start` fills its replay buffer."""
        import torch

        from agents.learning.sac.inputs import Foresight

        arguments = self._common(env, seed, log, "qf")
        # Clipped means would need an actor of another kind in the bundles.
        arguments["policy_kwargs"] |= {"log_std_init": self.log_std_init, "clip_mean": 0.0}
        episodes = env.get_attr("episodes", 0)[0]
        arguments["policy_kwargs"]["view"] = Foresight(episodes.layout, episodes.arm, episodes.pose)
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

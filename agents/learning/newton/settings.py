"""Settings of the imitation of Newton's steps."""

from __future__ import annotations

from dataclasses import dataclass

from agents.learning.settings import check_counts, check_shares


@dataclass(frozen=True, kw_only=True)
class NewtonSettings:
    """Settings of the imitation of Newton's steps, by rounds of playing, improving and fitting.

    Raises ValueError naming the argument, the rule and the value.
    """

    rounds: int = 40
    """Number of rounds; each draws new tasks."""
    num_envs: int = 32
    """Number of tasks in a round."""
    newton_steps: int = 3
    """Number of Newton's steps from the policy's motion in each task."""
    first_price: float = 12.0
    """Price of an angle's square deviation in the first step [1/rad^2]; steps that succeed make the next ones cheaper.
    It keeps a step where its expansion holds."""
    smoothing: float = 0.02
    """Length that smooths the tracking error in the first round [m]."""
    smoothing_final: float = 0.002
    """The same from `smoothing_until` on [m]."""
    smoothing_until: float = 0.6
    """Share of the rounds during which the smoothing falls [-], in (0, 1]."""
    led_rounds: int = 2
    """Number of rounds at the start in which the initial policy drives and the network only watches."""
    policy_noise: float = 0.06
    """Largest standard deviation of the noise on the policy's actions in its second episode of each task, in units of
    the supply voltage."""
    teacher_noise: float = 0.03
    """Standard deviation of the noise on the teacher's actions in its episode, in units of the supply voltage."""
    most_rounds: int = 40
    """Most rounds whose labels the network is fitted to; the later half of them so far, if that is fewer."""
    gradient_steps: int = 160
    """Number of gradient steps after every round, twice as many after a led one."""
    batch_size: int = 2048
    """Number of samples in each gradient step."""
    learning_rate: float = 1.5e-3
    """Learning rate at the start [-]; falls along half a cosine."""
    averaging: float = 0.02
    """Share of the present weights that a gradient step puts into the average, which drives and is kept [-]."""
    hidden: tuple[int, ...] = (192, 192)
    """Number of units in each hidden layer, whose activation is SiLU."""
    evaluate_every: int = 5
    """Number of rounds between two evaluations, each of which leaves a checkpoint."""

    def __post_init__(self) -> None:
        check_counts(self, "rounds", "num_envs", "newton_steps", "led_rounds", "most_rounds", "gradient_steps")
        check_counts(self, "batch_size", "hidden", "evaluate_every")
        check_shares(self, "smoothing_until", "averaging")
        for name in ("first_price", "smoothing", "smoothing_final", "learning_rate"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")

    def smoothing_at(self, done: float) -> float:
        """Smoothing when a share of the rounds is done [m]: each round the same factor."""
        return self.smoothing * (self.smoothing_final / self.smoothing) ** min(1.0, done / self.smoothing_until)

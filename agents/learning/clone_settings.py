"""Settings of the imitation of the optimum."""

from __future__ import annotations

from dataclasses import dataclass

from agents.learning.settings import check_counts, check_shares


@dataclass(frozen=True, kw_only=True)
class CloneSettings:
    """Settings of the imitation of the LQR on the optimal trajectory, by rounds of playing, labelling and fitting.

    Raises ValueError naming the argument, the rule and the value.
    """

    rounds: int = 45
    """Number of rounds; in each, every arm plays an episode and the network is fitted to all states so far."""
    num_envs: int = 64
    """Number of arms that are simulated side by side."""
    teaching: float = 1.0 / 3.0
    """Share of the rounds in which the teacher drives some of the arms, fewer in each round [-], in (0, 1]."""
    noise: float = 0.02
    """Standard deviation of the noise on every other arm's actions, in units of the supply voltage."""
    gradient_steps: int = 200
    """Number of gradient steps after every round."""
    batch_size: int = 1024
    """Number of samples in each gradient step."""
    learning_rate: float = 2e-3
    """Learning rate at the start [-]; falls along half a cosine."""
    hidden: tuple[int, ...] = (128, 128)
    """Number of units in each hidden layer, whose activation is tanh."""

    def __post_init__(self) -> None:
        check_counts(self, "rounds", "num_envs", "gradient_steps", "batch_size", "hidden")
        check_shares(self, "teaching")

"""Settings of the imitation of the optimum."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class CloneSettings:
    """Imitation of the LQR on the optimal trajectory, by rounds of playing, labelling and fitting."""

    rounds: int = 45
    """Episodes of every arm; after each the network is fitted to all that was seen so far."""
    num_envs: int = 64
    """Arms side by side."""
    teaching: float = 1.0 / 3.0
    """Share of the rounds in which the teacher still drives some of the arms, ever fewer."""
    noise: float = 0.02
    """Standard deviation of what is added to every other arm's action, in units of the supply voltage."""
    gradient_steps: int = 200
    """After every round."""
    batch_size: int = 1024
    """Samples per gradient step."""
    learning_rate: float = 2e-3
    """At the start; falls along half a cosine."""
    hidden: tuple[int, ...] = (128, 128)
    """Widths of the tanh layers."""

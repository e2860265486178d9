"""Loss of proximal policy optimisation with its derivatives in closed form."""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor


class Batch(NamedTuple):
    """B control periods of an arm with n joints, from a rollout."""

    observation: Tensor
    """Observations before the action [-], shape (B, size)."""
    action: Tensor
    """Actions before they are clipped, in units of the actor's output [-], shape (B, n)."""
    log_prob: Tensor
    """Log-probabilities of the actions when they were drawn [-], shape (B,)."""
    advantage: Tensor
    """Advantages of the actions [return], shape (B,)."""
    returns: Tensor
    """Returns that the critic should have predicted [return], shape (B,)."""


class Spread(NamedTuple):
    """Standard deviations of normally distributed actions, in the forms that every batch needs."""

    inverse: Tensor
    """Inverses of the standard deviations [-], shape (n,)."""
    constant: Tensor
    """Log-probability of the mean action, negated [-], shape ()."""

    @classmethod
    def of(cls, log_std: Tensor) -> Spread:
        """From the natural logarithms of the standard deviations, shape (n,)."""
        return cls((-log_std).exp(), (log_std + 0.5 * math.log(2.0 * math.pi)).sum())


def log_prob(departure: Tensor, spread: Spread) -> Tensor:
    """Log-probabilities of normally distributed actions [-], shape (B,).

    Args:
        departure: actions less their means, in standard deviations [-], shape (B, n).
        spread: standard deviations.
    """
    return departure.square().sum(-1).mul_(-0.5).sub_(spread.constant)


class Surrogate(NamedTuple):
    """Clipped loss of B actions."""

    mean: Tensor
    """Derivative of the loss with respect to the means of the actions, shape (B, n)."""
    departure: Tensor
    """Actions less their means, in standard deviations [-], shape (B, n)."""
    slope: Tensor
    """Derivative of the loss with respect to the log-probabilities of the actions, shape (B, 1)."""
    log_ratio: Tensor
    """Logarithms of the actions' probabilities as multiples of those when they were drawn [-], shape (B,)."""
    loss: tuple[Tensor, Tensor]
    """Advantages times ratios, and times clipped ratios, of which the lower one counts [return], shapes (B,)."""

    @property
    def log_std(self) -> Tensor:
        """Derivative of the loss with respect to the logarithms of the standard deviations, shape (n,)."""
        return ((self.departure.square() - 1.0) * self.slope).sum(0)

    def figures(self, clip_range: float) -> tuple[float, float, float]:
        """Loss [return], share of ratios beyond the clip [-], and an estimate of the divergence [nat]."""
        change = self.log_ratio.exp() - 1.0
        clipped, divergence = (change.abs() > clip_range).float().mean(), (change - self.log_ratio).mean()
        return -torch.minimum(*self.loss).mean().item(), clipped.item(), divergence.item()


def surrogate(mean: Tensor, spread: Spread, batch: Batch, clip_range: float) -> Surrogate:
    """Loss that falls no further once an action's probability has changed by `clip_range` for the better.

    Args:
        mean: means of the actions [-], shape (B, n).
        spread: the actions' standard deviations.
        batch: control periods.
        clip_range: largest change of an action's probability ratio that the loss rewards [-].
    """
    departure = (batch.action - mean).mul_(spread.inverse)
    log_ratio = log_prob(departure, spread).sub_(batch.log_prob)
    ratio = log_ratio.exp()
    free, held = batch.advantage * ratio, batch.advantage * ratio.clamp(1.0 - clip_range, 1.0 + clip_range)
    # Where the clipped value is the lower one, the loss does not depend on the action's probability.
    slope = torch.where(free <= held, free, 0.0).div_(-len(free)).unsqueeze(-1)
    return Surrogate((departure * slope).mul_(spread.inverse), departure, slope, log_ratio, (free, held))

"""Twin critics that are quadratic in how far an action departs from a centre."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from agents.learning.sac.inputs import Foresight, Sharpened


class Quadratic(NamedTuple):
    """Value of B states' actions by two critics: value + slope d - (curvature d^2 + |factors d|^2) / 2.

    d is the departure of the action from the state's centre, in units of the actor's output. The value is concave: it
    has one best action, and a step from the centre towards it is no longer than slope over curvature.
    """

    value: Tensor
    """Of the centre, (2, B)."""
    slope: Tensor
    """(2, B, n)."""
    curvature: Tensor
    """Positive, (2, B, n)."""
    factors: Tensor
    """What couples the joints, (2, B, rank, n)."""

    def __call__(self, departure: Tensor) -> Tensor:
        """Of actions that depart by (B, n), (2, B)."""
        own = ((self.slope - 0.5 * self.curvature * departure) * departure).sum(-1)
        coupled = (self.factors @ departure.unsqueeze(-1)).squeeze(-1).square().sum(-1)
        return self.value + own - 0.5 * coupled

    def detach(self) -> Quadratic:
        """The same without its history."""
        return Quadratic(*(part.detach() for part in self))


class QuadraticCritics(nn.Module):
    """Two networks side by side from the observation to a `Quadratic` each.

    Args:
        view: what the networks see of the observation.
        n_actions: joints.
        hidden: widths of the ReLU layers.
        rank: of what couples the joints.
    """

    optimizer: torch.optim.Optimizer

    def __init__(self, view: Sharpened | Foresight, n_actions: int, hidden: Sequence[int], rank: int = 4) -> None:
        super().__init__()
        self.view, self.n_actions, self.rank = view, n_actions, rank
        sizes = (view.size, *hidden, 1 + (2 + rank) * n_actions)
        self.weights, self.biases = nn.ParameterList(), nn.ParameterList()
        for size, after in pairwise(sizes):
            # As torch draws its linear layers.
            bound = size**-0.5
            self.weights.append(nn.Parameter(torch.empty(2, size, after).uniform_(-bound, bound)))
            self.biases.append(nn.Parameter(torch.empty(2, 1, after).uniform_(-bound, bound)))

    def forward(self, observation: Tensor) -> Quadratic:
        """Of B observations."""
        seen = self.view(observation)
        x = seen.expand(2, *seen.shape)
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            x = torch.baddbmm(bias, functional.relu(x) if k else x, weight)
        value, slope, curvature, factors = x.split((1, self.n_actions, self.n_actions, self.rank * self.n_actions), -1)
        return Quadratic(
            value.squeeze(-1),
            slope,
            functional.softplus(curvature),
            factors.unflatten(-1, (self.rank, self.n_actions)),
        )

    def set_training_mode(self, mode: bool) -> None:
        """What Stable-Baselines3 calls `train`."""
        self.train(mode)

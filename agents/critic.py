"""Twin critics that are quadratic in how far an action departs from a centre."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

STRETCH = 50.0
"""Values far below its inverse are made larger, far above it smaller."""
GAIN = 3.0
"""Of all that the networks see: larger inputs let them bend more sharply."""


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
        n_observations: entries of the observation.
        n_actions: joints.
        hidden: widths of the ReLU layers.
        vectors: first and last-plus-one entry of each part of the observation whose length costs, such as an error. The
            value has a cone's tip where it vanishes, which a network of these widths rounds off by centimetres: it
            also sees the length, and the part with its small values stretched.
        rank: of what couples the joints.
    """

    optimizer: torch.optim.Optimizer

    def __init__(
        self,
        n_observations: int,
        n_actions: int,
        hidden: Sequence[int],
        vectors: Sequence[tuple[int, int]] = (),
        rank: int = 4,
    ) -> None:
        super().__init__()
        self.n_actions, self.rank = n_actions, rank
        self.vectors = tuple(slice(*vector) for vector in vectors)
        seen = n_observations + sum(1 + end - first for first, end in vectors)
        sizes = (seen, *hidden, 1 + (2 + rank) * n_actions)
        self.weights, self.biases = nn.ParameterList(), nn.ParameterList()
        for size, after in pairwise(sizes):
            # As torch draws its linear layers.
            bound = size**-0.5
            self.weights.append(nn.Parameter(torch.empty(2, size, after).uniform_(-bound, bound)))
            self.biases.append(nn.Parameter(torch.empty(2, 1, after).uniform_(-bound, bound)))

    def forward(self, observation: Tensor) -> Quadratic:
        """Of (B, n_observations)."""
        seen = self.sharpened(observation)
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

    def sharpened(self, observation: Tensor) -> Tensor:
        """What the networks see: the observation, lengths and stretched vectors."""
        vectors = [observation[:, vector] for vector in self.vectors]
        lengths = [vector.norm(dim=1, keepdim=True) for vector in vectors]
        stretched = [0.5 * torch.asinh(STRETCH * vector) for vector in vectors]
        return GAIN * torch.cat((observation, *lengths, *stretched), dim=1)

    def set_training_mode(self, mode: bool) -> None:
        """What Stable-Baselines3 calls `train`."""
        self.train(mode)

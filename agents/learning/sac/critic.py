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
    """Values of the actions of n joints in B states by two critics [return]: quadratic and concave in the action.

        value + slope . d - (curvature . d^2 + |factors d|^2) / 2

    d is the action less the state's centre, in units of the actor's output [-], shape (B, n). There is one best action,
    and a step from the centre towards it is no longer than slope over curvature.
    """

    value: Tensor
    """Value of the centre [return], shape (2, B)."""
    slope: Tensor
    """Derivative of the value with respect to d at the centre [return], shape (2, B, n)."""
    curvature: Tensor
    """Curvature of the value along each joint alone [return], positive, shape (2, B, n)."""
    factors: Tensor
    """Factors of the curvature that couples the joints [return^(1/2)], shape (2, B, rank, n)."""

    def __call__(self, departure: Tensor) -> Tensor:
        """Values of actions [return], shape (2, B).

        Args:
            departure: actions less the centres, in units of the actor's output [-], shape (B, n).
        """
        own = ((self.slope - 0.5 * self.curvature * departure) * departure).sum(-1)
        coupled = (self.factors @ departure.unsqueeze(-1)).squeeze(-1).square().sum(-1)
        return self.value + own - 0.5 * coupled

    def detach(self) -> Quadratic:
        """A copy that takes no gradients."""
        return Quadratic(*(part.detach() for part in self))


class QuadraticCritics(nn.Module):
    """Two networks side by side from the observation to a `Quadratic` each.

    Args:
        view: inputs of the networks from the observation.
        n_actions: number of joints n.
        hidden: number of units in each hidden layer, whose activation is ReLU.
        rank: rank of the curvature that couples the joints.
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
        """Values of the actions in B states.

        Args:
            observation: observations [-], shape (B, size).
        """
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
        """Switches between training and evaluation, under the name that Stable-Baselines3 calls."""
        self.train(mode)

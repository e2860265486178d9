"""Network that the recipes of PyTorch's libraries share."""

from __future__ import annotations

from torch import nn


def perceptron(size: int, out: int, hidden: int = 64) -> nn.Sequential:
    """Two hidden layers; the last layer starts near zero, so that the first actions are small."""
    layers = nn.Sequential(
        nn.Linear(size, hidden), nn.SiLU(), nn.Linear(hidden, hidden), nn.SiLU(), nn.Linear(hidden, out)
    )
    nn.init.orthogonal_(layers[-1].weight, 0.01)
    nn.init.zeros_(layers[-1].bias)
    return layers

"""Adam over parameters that lie in one tensor."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor

from agents.learning.compiled import entry
from agents.learning.passes import Array

LINE = 16
"""Number of parameters in a line of the cache."""


@entry
def _step(
    values: Array, gradient: Array, mean: Array, square: Array, short: float, long: float, rate: float, epsilon: float
) -> None:
    """Moves the parameters, and the means of gradients and of their squares that decay by `short` and `long`."""
    fresh, fresh_square = np.float32(1.0 - short), np.float32(1.0 - long)
    kept, pace, least = np.float32(long), np.float32(rate), np.float32(epsilon)
    for i in range(len(values)):
        mean[i] += fresh * (gradient[i] - mean[i])
        square[i] = kept * square[i] + fresh_square * gradient[i] * gradient[i]
        values[i] -= pace * mean[i] / (math.sqrt(square[i]) + least)


class FlatAdam:
    """Adam whose parameters become parts of one tensor, and their gradients parts of another.

    A step is one compiled loop over all parameters: an operation after another on each of them takes small networks
    many times as long. It takes the place of one of torch's, whose import of a compiler takes longer than 100 000
    control periods.

    Args:
        params: parameters on the CPU. They keep their places from here on, and so do their gradients from each
            `zero_grad` on.
        lr: learning rate [-].
        betas: decay of the means of the gradients and of their squares [-].
        eps: gradients well below it move their parameters little [-].
    """

    def __init__(
        self, params: Iterable[Tensor], lr: float, betas: tuple[float, float] = (0.9, 0.999), eps: float = 1e-8
    ) -> None:
        parts = list(params)
        self.param_groups = [{"lr": lr}]
        """The learning rate, as torch's optimizers have it."""
        self._betas, self._eps = betas, eps
        # Each starts where a vector register's load does not cross a line of the cache.
        sizes = [-(-part.numel() // LINE) * LINE for part in parts]
        self.values = torch.zeros(sum(sizes))
        """All parameters, one after the other."""
        self.gradient = torch.zeros_like(self.values)
        """Their gradients."""
        self._mean, self._square, self._steps = torch.zeros_like(self.values), torch.zeros_like(self.values), 0
        self._slopes: list[tuple[Tensor, Tensor]] = []
        for part, values, slopes in zip(parts, self.values.split(sizes), self.gradient.split(sizes), strict=True):
            part.data = values[: part.numel()].view_as(part).copy_(part.data)
            self._slopes.append((part, slopes[: part.numel()].view_as(part)))
        self.zero_grad()

    def zero_grad(self, set_to_none: bool = True) -> None:
        """Makes all gradients zero, in their places even if `set_to_none`, which another optimizer may have done."""
        del set_to_none
        self.gradient.zero_()
        for part, slope in self._slopes:
            part.grad = slope

    def place(self, parameter: Tensor) -> int:
        """Position of a parameter's first number in `values`. ValueError where it does not lie there."""
        found = (parameter.data_ptr() - self.values.data_ptr()) // self.values.element_size()
        if not 0 <= found < len(self.values):
            raise ValueError(f"parameter must be one of the optimizer's, got one of shape {tuple(parameter.shape)}")
        return found

    def clip(self, longest: float) -> None:
        """Scales the gradient down to a norm of `longest`, as torch's `clip_grad_norm_` does."""
        norm = torch.linalg.vector_norm(self.gradient).item()
        if norm > longest:
            self.gradient.mul_(longest / (norm + 1e-6))

    def step(self) -> None:
        """Moves the parameters."""
        self._steps += 1
        short, long = self._betas
        # The means begin at zero.
        scale = (1.0 - long**self._steps) ** 0.5
        rate = self.param_groups[0]["lr"] * scale / (1.0 - short**self._steps)
        arrays = (part.numpy() for part in (self.values, self.gradient, self._mean, self._square))
        _step(*arrays, short, long, rate, self._eps * scale)

    def state_dict(self) -> dict[str, Any]:
        """What a step depends on, but for parameters, gradients and settings."""
        return {"mean": self._mean, "square": self._square, "steps": self._steps}

    def load_state_dict(self, state: Mapping[str, Any], strict: bool = True) -> None:
        """Takes over what `state_dict` gave. ValueError for other sizes, whatever `strict` says."""
        del strict
        if state["mean"].shape != self._mean.shape:
            raise ValueError(f"state must be of {len(self._mean)} parameters, got {len(state['mean'])}")
        self._mean.copy_(state["mean"])
        self._square.copy_(state["square"])
        self._steps = state["steps"]

"""Fully connected layers with their derivatives in closed form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

_aten = torch.ops.aten


class Activation(NamedTuple):
    """Function after a hidden layer, elementwise."""

    value: Callable[[Tensor], Tensor]
    """Value at x."""
    backward: Callable[[Tensor, Tensor, Tensor], Tensor]
    """Derivative with respect to x, from that with respect to the value, whose memory it takes, x and the value."""


ACTIVATIONS: dict[type[nn.Module], Activation] = {
    nn.SiLU: Activation(
        functional.silu, lambda slope, x, _: _aten.silu_backward.grad_input(slope, x, grad_input=slope)
    ),
    nn.Tanh: Activation(torch.tanh, lambda slope, _, y: _aten.tanh_backward.grad_input(slope, y, grad_input=slope)),
    nn.ReLU: Activation(
        torch.relu, lambda slope, _, y: _aten.threshold_backward.grad_input(slope, y, 0.0, grad_input=slope)
    ),
    nn.ELU: Activation(
        functional.elu,
        lambda slope, x, _: _aten.elu_backward.grad_input(slope, 1.0, 1.0, 1.0, False, x, grad_input=slope),
    ),
}
"""Functions by torch's modules with their default arguments."""


class Layers:
    """Linear layers with an activation between each two, whose gradients go into memory that is there already.

    Torch's record of the operations costs about as much as these small matrices' products do.

    Args:
        modules: linear layers with activations in between; where gradients are asked for, their parameters have some.
    """

    def __init__(self, modules: Sequence[nn.Module]) -> None:
        self._linear = [module for module in modules if isinstance(module, nn.Linear)]
        self._activations = [ACTIVATIONS[type(module)] for module in modules if not isinstance(module, nn.Linear)]
        self._inputs: list[Tensor] = []
        self._sums: list[Tensor] = []

    def forward(self, x: Tensor) -> Tensor:
        """Outputs [-], shape (B, outputs), of inputs of shape (B, inputs)."""
        self._inputs, self._sums = [x], []
        for layer, activation in zip(self._linear, self._activations, strict=False):
            self._sums.append(functional.linear(self._inputs[-1], layer.weight, layer.bias))
            self._inputs.append(activation.value(self._sums[-1]))
        return functional.linear(self._inputs[-1], self._linear[-1].weight, self._linear[-1].bias)

    def backward(self, slope: Tensor) -> None:
        """Writes the gradients of the parameters of the last call of `forward`, whose values it gives back as it goes.

        Args:
            slope: derivative of a loss with respect to the outputs, shape (B, outputs).
        """
        for k in reversed(range(len(self._linear))):
            layer, value = self._linear[k], self._inputs.pop()
            torch.mm(slope.t(), value, out=layer.weight.grad)
            torch.sum(slope, 0, out=layer.bias.grad)
            if k:
                slope = torch.mm(slope, layer.weight)
                slope = self._activations[k - 1].backward(slope, self._sums.pop(), value)

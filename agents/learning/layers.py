"""Torch's fully connected layers as compiled passes take them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from torch import Tensor, nn

from agents.learning.passes import ELU, RELU, SILU, TANH, Array, Integers, Room, outputs_of

KINDS: dict[type[nn.Module], int] = {nn.SiLU: SILU, nn.Tanh: TANH, nn.ReLU: RELU, nn.ELU: ELU}
"""Functions after hidden layers by torch's modules with their default arguments."""


def compilable(modules: Sequence[nn.Module]) -> bool:
    """Whether networks are of layers that the passes know, with one kind of function in between, and all learn."""
    kinds = {type(module) for module in modules} - {nn.Linear}
    learns = all(part.requires_grad for module in modules for part in module.parameters())
    return learns and kinds <= set(KINDS) and len(kinds) <= 1


def places_of(modules: Sequence[nn.Module], place: Callable[[Tensor], int]) -> Integers:
    """A network's places: for each layer the positions of weights and biases, and the numbers of inputs and outputs.

    Args:
        modules: linear layers with functions in between.
        place: position of a parameter in the array of all.
    """
    linear = [module for module in modules if isinstance(module, nn.Linear)]
    return np.array([(place(one.weight), place(one.bias), one.in_features, one.out_features) for one in linear])


def kind_of(modules: Sequence[nn.Module]) -> int:
    """Function after the hidden layers of networks; SILU where they have none."""
    return next((KINDS[type(module)] for module in modules if not isinstance(module, nn.Linear)), SILU)


def outputs(x: Array, parameters: Array, places: Integers, kind: int, room: Room) -> Array:
    """Outputs of a network [-], shape (B, outputs).

    Args:
        x: inputs [-], shape (B, inputs).
        parameters: array of all parameters.
        places: the network's places in it.
        kind: function after the hidden layers.
        room: memory.
    """
    found = np.empty((len(x), places[-1, 3]), np.float32)
    outputs_of(np.ascontiguousarray(x, np.float32), parameters, places, kind, room, found)
    return found

"""Networks that are fitted to samples by squared errors, compiled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agents.learning.compiled import entry
from agents.learning.passes import ROWS, SILU, Array, Integers, Room, backward, forward, gather, room_for, transpose

if TYPE_CHECKING:
    from torch import nn


@entry
def _gradient(
    batch: Integers,
    inputs: Array,
    targets: Array,
    squashed: bool,
    parameters: Array,
    places: Integers,
    kind: int,
    room: Room,
    gradient: Array,
) -> None:
    """Gradient of the mean squared error of a batch, over its B samples and all outputs.

    Args:
        batch: numbers of its samples, shape (B,).
        inputs: inputs of all samples, shape (S, size).
        targets: what the network should give, shape (S, n).
        squashed: whether the network's outputs go through a tanh.
        parameters: the network's parameters.
        places: where they lie.
        kind: function after the hidden layers.
        room: memory.
        gradient: memory of the derivatives in the places of the parameters.
    """
    scale, one = np.float32(2.0 / (len(batch) * targets.shape[1])), np.float32(1.0)
    gradient[:] = np.float32(0.0)
    transpose(parameters, places, room)
    for begin in range(0, len(batch), ROWS):
        block = batch[begin : begin + ROWS]
        x = gather(inputs, block, room)
        found = forward(x, parameters, places, kind, room)
        back = room.back[0, : found.size].reshape(found.shape)
        for r in range(len(block)):
            for i in range(found.shape[1]):
                value, slope = found[r, i], scale
                if squashed:
                    value = math.tanh(value)
                    slope = scale * (one - value * value)
                back[r, i] = slope * (value - targets[block[r], i])
        backward(x, parameters, places, room, gradient)


class Fit:
    """Adam's steps of a network down the mean squared error of batches, over samples and outputs.

    Args:
        layers: linear layers with one kind of function in between, whose parameters become parts of one tensor.
        squashed: whether the outputs go through a tanh.
    """

    def __init__(self, layers: Sequence[nn.Module], squashed: bool = False) -> None:
        from agents.learning.flat_adam import FlatAdam
        from agents.learning.layers import kind_of, places_of

        self._optimizer = FlatAdam((part for layer in layers for part in layer.parameters()), lr=0.0)
        self._places, self._kind, self._squashed = places_of(layers, self._optimizer.place), kind_of(layers), squashed
        self._room = room_for(self._places)

    def step(self, batch: Integers, inputs: Array, targets: Array, rate: float) -> None:
        """Makes a gradient step.

        Args:
            batch: numbers of its samples, shape (B,).
            inputs: inputs of all samples [-], shape (S, size).
            targets: what the network should give [-], shape (S, n).
            rate: learning rate [-].
        """
        optimizer = self._optimizer
        arrays = optimizer.values.numpy(), self._places, self._kind, self._room, optimizer.gradient.numpy()
        _gradient(batch, inputs, targets, self._squashed, *arrays)
        optimizer.param_groups[0]["lr"] = rate
        optimizer.step()


def compile_fit() -> None:
    """Compiles what a fit calls, where it is not on disk, by a network of one input and output."""
    places, (parameters, gradient) = np.array([(0, 16, 1, 1)]), np.zeros((2, 32), np.float32)
    one = np.ones((1, 1), np.float32)
    _gradient(np.zeros(1, np.int64), one, one, False, parameters, places, SILU, room_for(places), gradient)

"""Compiled passes through small networks.

A batch goes through a network in blocks of `ROWS` samples, whose values stay in the processor's nearest caches. Torch
takes as long to call the operations of such small networks as the matrices' products take.

The parameters of several networks lie in one array. A network's `places` tell where: a row for each layer with the
positions of its weights and biases in that array, and its numbers of inputs and outputs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.learning.compiled import compiled, entry

Array = NDArray[np.float32]
Integers = NDArray[np.int64]
ROWS = 128
"""Number of samples in a block."""
SILU, TANH, RELU, ELU, LINEAR = range(5)
"""Functions after a layer."""

_ORDER = 12
_C = [math.comb(_ORDER, k) / math.perm(2 * _ORDER, k) for k in range(_ORDER + 1)]
_C1, _C2, _C3, _C4, _C5, _C6, _C7, _C8, _C9, _C10, _C11, _C12 = (np.float32(c) for c in _C[1:])
_LARGE, _ZERO, _HALF, _ONE, _TWO = (np.float32(x) for x in (16.0, 0.0, 0.5, 1.0, 2.0))


class Room(NamedTuple):
    """Memory for the passes of a block of rows."""

    x: Array
    """Inputs, shape (`ROWS`, inputs)."""
    value: Array
    """Values after each layer, one layer after the other."""
    slope: Array
    """Derivatives of these values with respect to the layers' sums."""
    back: Array
    """Derivatives of the loss with respect to the values of two layers that follow each other, shape (2, ...)."""
    product: Array
    """Derivatives of a block's loss with respect to a layer's weights."""
    transposed: Array
    """Weights of each layer with the inputs first, in the places of the parameters."""


def room_for(*networks: Integers) -> Room:
    """Memory that suffices for each of some networks by their places."""
    widest = max(int(places[:, 3].max()) for places in networks)
    sizes = (
        ROWS * max(int(places[:, 3].sum()) for places in networks),
        max(int((places[:, 2] * places[:, 3]).max()) for places in networks),
        max(int(places[:, 0].max() + (places[:, 2] * places[:, 3]).max()) for places in networks),
    )
    x = np.empty((ROWS, max(int(places[0, 2]) for places in networks)), np.float32)
    values, product, transposed = (np.empty(size, np.float32) for size in sizes)
    return Room(x, values, np.empty_like(values), np.empty((2, ROWS * widest), np.float32), product, transposed)


@compiled
def _exponential(x: float) -> tuple[float, float]:
    """Odd and even part of Pade's polynomial p, with e^x = p(x) / p(-x) to single precision up to `_LARGE`."""
    x = min(max(x, -_LARGE), _LARGE)
    s = x * x
    odd = x * (_C1 + s * (_C3 + s * (_C5 + s * (_C7 + s * (_C9 + s * _C11)))))
    return odd, _ONE + s * (_C2 + s * (_C4 + s * (_C6 + s * (_C8 + s * (_C10 + s * _C12)))))


@compiled
def _activate(value: Array, slope: Array, bias: Array, kind: int) -> None:
    """Puts the function's values in place of a layer's sums, which lack the bias, and its derivatives in `slope`."""
    rows, width = value.shape
    for r in range(rows):
        if kind == SILU:
            for i in range(width):
                x = value[r, i] + bias[i]
                odd, even = _exponential(x)
                share = _HALF + _HALF * odd / even if x > -_LARGE else _ZERO
                value[r, i], slope[r, i] = x * share, share * (_ONE + x * (_ONE - share))
        elif kind == TANH:
            for i in range(width):
                odd, even = _exponential(_TWO * (value[r, i] + bias[i]))
                y = odd / even
                value[r, i], slope[r, i] = y, _ONE - y * y
        elif kind == RELU:
            for i in range(width):
                x = value[r, i] + bias[i]
                value[r, i], slope[r, i] = max(x, _ZERO), _ONE if x > _ZERO else _ZERO
        elif kind == ELU:
            for i in range(width):
                x = value[r, i] + bias[i]
                odd, even = _exponential(min(x, _ZERO))
                below = _TWO * odd / (even - odd)
                value[r, i], slope[r, i] = x if x > _ZERO else below, _ONE + below
        else:
            for i in range(width):
                value[r, i], slope[r, i] = value[r, i] + bias[i], _ONE


@compiled
def transpose(parameters: Array, places: Integers, room: Room) -> None:
    """Puts a network's weights with the inputs first into the room, for the passes until they change."""
    for k in range(len(places)):
        weight, _, inputs, outputs = places[k]
        weights = parameters[weight : weight + inputs * outputs].reshape(outputs, inputs)
        other = room.transposed[weight : weight + inputs * outputs].reshape(inputs, outputs)
        for i in range(inputs):
            for j in range(outputs):
                other[i, j] = weights[j, i]


@compiled
def gather(inputs: Array, block: Integers, room: Room) -> Array:
    """Inputs of a block's samples by their numbers, shape (rows, inputs), in the room."""
    x = room.x[: len(block)]
    for r in range(len(block)):
        for i in range(x.shape[1]):
            x[r, i] = inputs[block[r], i]
    return x


@compiled
def forward(x: Array, parameters: Array, places: Integers, kind: int, room: Room) -> Array:
    """Outputs of a block, shape (rows, outputs); the room holds the values and slopes of all layers then.

    Args:
        x: inputs, shape (rows, inputs).
        parameters: parameters of the networks.
        places: the network's.
        kind: function after its hidden layers.
        room: memory with the network's weights in `transposed`.
    """
    first = 0
    for k in range(len(places)):
        weight, bias, inputs, outputs = places[k]
        last = first + len(x) * outputs
        value = room.value[first:last].reshape(len(x), outputs)
        np.dot(x, room.transposed[weight : weight + inputs * outputs].reshape(inputs, outputs), value)
        after = kind if k < len(places) - 1 else LINEAR
        _activate(value, room.slope[first:last].reshape(len(x), outputs), parameters[bias : bias + outputs], after)
        x, first = value, last
    return x


@compiled
def backward(x: Array, parameters: Array, places: Integers, room: Room, gradient: Array) -> None:
    """Adds the derivatives of a block's loss with respect to a network's parameters to the gradient.

    Args:
        x: inputs of the block, which `forward` has just had, shape (rows, inputs).
        parameters: parameters of the networks.
        places: the network's.
        room: memory with the derivatives with respect to the outputs in `back[0]`.
        gradient: derivatives in the places of the parameters.
    """
    rows, last, now = len(x), len(x) * places[:, 3].sum(), 0
    for k in range(len(places) - 1, -1, -1):
        weight, bias, inputs, outputs = places[k]
        first, size = last - rows * outputs, inputs * outputs
        back = room.back[now, : rows * outputs].reshape(rows, outputs)
        slope, of_bias = room.slope[first:last].reshape(rows, outputs), gradient[bias : bias + outputs]
        for r in range(rows):
            for i in range(outputs):
                back[r, i] *= slope[r, i]
                of_bias[i] += back[r, i]
        before = x if k == 0 else room.value[first - rows * inputs : first].reshape(rows, inputs)
        product, of_weights = room.product[:size], gradient[weight : weight + size]
        np.dot(back.T, before, product.reshape(outputs, inputs))
        for i in range(size):
            of_weights[i] += product[i]
        if k > 0:
            weights = parameters[weight : weight + size].reshape(outputs, inputs)
            np.dot(back, weights, room.back[1 - now, : rows * inputs].reshape(rows, inputs))
        last, now = first, 1 - now


@entry
def outputs_of(x: Array, parameters: Array, places: Integers, kind: int, room: Room, found: Array) -> None:
    """Puts the outputs of a network for S inputs into `found`, shape (S, outputs); the others as of `forward`."""
    transpose(parameters, places, room)
    for first in range(0, len(x), ROWS):
        value = forward(x[first : first + ROWS], parameters, places, kind, room)
        # An assignment of slices would take two seconds to compile, for the text of its error.
        for r in range(len(value)):
            for i in range(value.shape[1]):
                found[first + r, i] = value[r, i]

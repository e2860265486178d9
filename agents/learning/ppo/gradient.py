"""Compiled gradient of the loss of proximal policy optimisation."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.learning.compiled import compiled, entry
from agents.learning.passes import (
    ROWS,
    SILU,
    Array,
    Integers,
    Room,
    backward,
    forward,
    gather,
    outputs_of,
    room_for,
    transpose,
)

_ZERO, _HALF, _ONE = (np.float32(x) for x in (0.0, 0.5, 1.0))
_LOG_ROOT = np.float32(0.5 * math.log(2.0 * math.pi))


class Samples(NamedTuple):
    """S control periods of an arm with n joints, from a rollout."""

    observation: Array
    """Observations before the action [-], shape (S, size)."""
    action: Array
    """Actions before they are clipped, in units of the actor's output [-], shape (S, n)."""
    log_prob: Array
    """Log-probabilities of the actions when they were drawn [-], shape (S,)."""
    advantage: Array
    """Advantages of the actions [return], shape (S,)."""
    returns: Array
    """Returns that the critic should have predicted [return], shape (S,)."""


class Networks(NamedTuple):
    """Actor and critic in an array of parameters."""

    actor: Integers
    """Places of the actor, whose outputs are the means of the actions."""
    critic: Integers
    """Places of the critic."""
    kind: int
    """Function after the hidden layers."""
    log_std: int
    """Position of the natural logarithms of the actions' standard deviations."""


class Loss(NamedTuple):
    """Weights and bounds of the loss."""

    clip_range: float
    """Largest change of an action's probability ratio that the loss rewards [-]."""
    vf_coef: float
    """Weight of the value function's squared error [-]."""
    normalize: bool
    """Whether the advantages of a batch are scaled to mean 0 and standard deviation 1."""


@compiled
def _normal(advantage: Array, batch: Integers, normalize: bool) -> tuple[float, float]:
    """What is taken off a batch's advantages, and what the rest is multiplied by."""
    if not normalize or len(batch) < 2:
        return _ZERO, _ONE
    total, squares = 0.0, 0.0
    for i in batch:
        total += advantage[i]
    mean = total / len(batch)
    for i in batch:
        squares += (advantage[i] - mean) ** 2
    return np.float32(mean), np.float32(1.0 / (math.sqrt(squares / (len(batch) - 1)) + 1e-8))


@compiled
def _surrogate(
    mean: Array,
    block: Integers,
    samples: Samples,
    log_std: Array,
    inverse: Array,
    clip_range: float,
    normal: tuple[float, float],
    back: Array,
    of_log_std: Array,
    figures: NDArray[np.float64],
) -> None:
    """Sums over a block's actions of their loss, of those beyond the clip and of the divergence, with derivatives.

    The loss falls no further once an action's probability has changed by `clip_range` for the better: where the
    clipped value is the lower one, it does not depend on the probability.

    Args:
        mean: means of the actions, shape (rows, n).
        block: numbers of the samples.
        samples: control periods.
        log_std: natural logarithms of the actions' standard deviations, shape (n,).
        inverse: inverses of the standard deviations, shape (n,).
        clip_range: largest change of an action's probability ratio that the loss rewards.
        normal: what is taken off the advantages, and what the rest is multiplied by.
        back: memory of the derivatives with respect to the means, shape (rows, n).
        of_log_std: derivatives with respect to `log_std`, to which the block's are added.
        figures: the three sums.
    """
    constant, clip = _ZERO, np.float32(clip_range)
    for j in range(len(log_std)):
        constant += log_std[j] + _LOG_ROOT
    for r in range(len(block)):
        sample, squares = block[r], _ZERO
        for j in range(len(log_std)):
            departure = (samples.action[sample, j] - mean[r, j]) * inverse[j]
            back[r, j] = departure
            squares += departure * departure
        log_ratio = -_HALF * squares - constant - samples.log_prob[sample]
        ratio = math.exp(log_ratio)
        advantage = (samples.advantage[sample] - normal[0]) * normal[1]
        free, held = advantage * ratio, advantage * min(max(ratio, _ONE - clip), _ONE + clip)
        # A NaN compares false: in this order it reaches the actor, which otherwise would stand still without a word.
        slope = _ZERO if free > held else -free
        for j in range(len(log_std)):
            departure = back[r, j]
            back[r, j] = departure * slope * inverse[j]
            of_log_std[j] += (departure * departure - _ONE) * slope
        figures[0] -= min(free, held)
        figures[1] += abs(ratio - _ONE) > clip
        figures[2] += ratio - _ONE - log_ratio


@entry
def gradient_of(
    batch: Integers,
    samples: Samples,
    parameters: Array,
    networks: Networks,
    loss: Loss,
    room: Room,
    gradient: Array,
    figures: NDArray[np.float64],
) -> None:
    """Gradient of the loss of a batch, the mean over its B samples.

    Args:
        batch: numbers of its samples, shape (B,).
        samples: control periods.
        parameters: parameters of both networks and of the standard deviations.
        networks: where they lie.
        loss: weights and bounds.
        room: memory.
        gradient: memory of the derivatives in the places of the parameters.
        figures: memory of the means of the clipped loss [return], the share of probability ratios beyond the clip [-],
            an estimate of the divergence [nat] and the critic's squared error [return^2].
    """
    first, last = networks.log_std, networks.log_std + samples.action.shape[1]
    log_std, of_log_std = parameters[first:last], gradient[first:last]
    inverse, normal = np.exp(-log_std), _normal(samples.advantage, batch, loss.normalize)
    share, pull = np.float32(1.0 / len(batch)), np.float32(2.0 * loss.vf_coef)
    gradient[:], figures[:] = _ZERO, 0.0
    transpose(parameters, networks.actor, room)
    transpose(parameters, networks.critic, room)
    for begin in range(0, len(batch), ROWS):
        block = batch[begin : begin + ROWS]
        x = gather(samples.observation, block, room)
        mean = forward(x, parameters, networks.actor, networks.kind, room)
        back = room.back[0, : mean.size].reshape(mean.shape)
        _surrogate(mean, block, samples, log_std, inverse, loss.clip_range, normal, back, of_log_std, figures)
        backward(x, parameters, networks.actor, room, gradient)
        value = forward(x, parameters, networks.critic, networks.kind, room)
        for r in range(len(block)):
            excess = value[r, 0] - samples.returns[block[r]]
            room.back[0, r] = pull * excess
            figures[3] += excess * excess
        backward(x, parameters, networks.critic, room, gradient)
    for i in range(len(gradient)):
        gradient[i] *= share
    for i in range(len(figures)):
        figures[i] *= share


def compile_loops() -> None:
    """Compiles what rollouts and updates call, where it is not on disk, by networks of one input and output."""
    actor, critic = (np.array([(place, place + 16, 1, 1)]) for place in (16, 48))
    networks, room = Networks(actor, critic, SILU, 0), room_for(actor, critic)
    parameters, gradient = np.zeros((2, 80), np.float32)
    one = np.ones((1, 1), np.float32)
    outputs_of(one, parameters, actor, SILU, room, one.copy())
    samples, loss = Samples(one, one, *one.repeat(3, axis=0)), Loss(clip_range=0.2, vf_coef=0.5, normalize=True)
    gradient_of(np.zeros(1, np.int64), samples, parameters, networks, loss, room, gradient, np.empty(4))

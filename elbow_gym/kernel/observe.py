"""Voltages of actions, points of paths, observations and rewards of a batch.

Compiled, so that an arm's bits do not depend on how many others there are.
"""

# pyright: basic

from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic

from elbow_gym.kernel.rows import BELOW_TABLE, HAND
from elbow_gym.kernel.sine import sincos
from elbow_gym.kernel.template import compiled, compiled_entry

_sincos = compiled(sincos)


def _multiply_and_add(context, a, b, c):
    def generate(_, builder, __, values):
        return builder.fma(*values)

    return types.float64(types.float64, types.float64, types.float64), generate


_rounded_once: Any = intrinsic(_multiply_and_add)


@compiled
def fused(a, b, c):
    """A b + c of floats, rounded once."""
    return _rounded_once(a, b, c)


@compiled
def _path_point(coefficients, c, s, out):
    ch, sh = c, s
    for axis in range(3):
        out[axis] = coefficients[0, axis]
    for h in range(1, coefficients.shape[0], 2):
        for axis in range(3):
            out[axis] += coefficients[h, axis] * ch + coefficients[h + 1, axis] * sh
        ch, sh = ch * c - sh * s, sh * c + ch * s


@compiled_entry
def drive(action, highest, volts, voltage):
    """Fills voltage (B, n) with the clipped action (B, n) in volts. False when an action is not a number.

    highest (B,) is each arm's largest action, volts (B,) what a unit of it is.
    """
    numbers = True
    for b in range(action.shape[0]):
        for a in range(action.shape[1]):
            value = action[b, a]
            numbers = numbers and not np.isnan(value)
            voltage[b, a] = min(max(value, -highest[b]), highest[b]) * volts[b]
    return numbers


@compiled_entry
def path(coefficients, angle, out):
    """Points out (m, 3) of a closed path at angles (m,): a Fourier series, rows 1, cos, sin, cos 2, sin 2..."""
    for i in range(angle.size):
        s, c = _sincos(angle[i])
        _path_point(coefficients, c, s, out[i])


@compiled_entry
def observe(
    state, summary, pose, coefficients, angle, lookahead, scale, high, price, spent, observation, figures, first, end
):
    """Fills observation (B, size) float32 and the rows FIGURES of figures, (9, B), for arms first..end-1.

    coefficients (B, rows, 3) and angle (B,) are each arm's path and where the target stands on it, lookahead (B,) the
    angle to what it looks ahead to. price is the tracking weight [1/m], the energy weight [1/W], the control frequency
    [Hz] and whether negative power counts; spent (B,) is the energy paid before [J], and is brought up to date.
    In compiled code so that an arm's bits do not depend on how many others there are.
    """
    n = state.shape[2]
    later = np.empty(3)
    target = np.empty(3)
    tracking_weight, energy_weight, frequency, regeneration = price
    for b in range(first, end):
        s, c = _sincos(angle[b])
        _path_point(coefficients[b], c, s, target)
        s_later, c_later = _sincos(angle[b] + lookahead[b])
        _path_point(coefficients[b], c_later, s_later, later)
        squared = 0.0
        for m in range(3 * n + 11):
            axis = (m - 3 * n) % 3
            if m < n:
                value = state[b, 0, m] - pose[m]
            elif m < 2 * n:
                value = state[b, 1, m - n]
            elif m < 3 * n:
                value = state[b, 2, m - 2 * n]
            elif m < 3 * n + 3:
                value = summary[b, HAND + axis] - target[axis]
                squared += value * value
            elif m < 3 * n + 6:
                value = summary[b, HAND + axis] - coefficients[b, 0, axis]
            elif m < 3 * n + 9:
                value = summary[b, HAND + axis] - later[axis]
            else:
                value = c if m == 3 * n + 9 else s
            observation[b, m] = min(max(np.float32(value / scale[m]), -high[m]), high[m])
        for row, meter in ((2, 3), (3, 4), (4, 7)):
            total = 0.0
            for a in range(n):
                total += state[b, meter, a]
            figures[row, b] = total
        paid = figures[2, b] if regeneration else figures[3, b]
        figures[0, b] = np.sqrt(squared)
        figures[1, b] = (paid - spent[b]) * frequency
        figures[5, b] = 0.0 - tracking_weight * figures[0, b]
        figures[6, b] = 0.0 - energy_weight * figures[1, b]
        figures[7, b] = summary[b, BELOW_TABLE]
        figures[8, b] = fused(-figures[1, b], energy_weight, figures[5, b])
        spent[b] = paid

"""Observations, rewards and points of paths of a batch of arms.

Compiled, so that an arm's bits do not depend on how many others there are.
"""

# pyright: basic

from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic

from elbow_gym.kernel import reward as plain
from elbow_gym.kernel.rows import BELOW_TABLE, HAND, METERED
from elbow_gym.kernel.sine import sincos
from elbow_gym.kernel.template import compiled, compiled_entry, renamed

_sincos = compiled(sincos)


def _multiply_and_add(context, a, b, c):
    def generate(_, builder, __, values):
        return builder.fma(*values)

    return types.float64(types.float64, types.float64, types.float64), generate


_rounded_once: Any = intrinsic(_multiply_and_add)


def _fused(a, b, c):
    return _rounded_once(a, b, c)


_reward = compiled(
    renamed(plain.reward, {"fused": compiled(_fused) if hasattr(_sincos, "py_func") else plain.fused}, "reward")
)


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
def path(coefficients, angle, out):
    """Points out (m, 3) of a closed path at angles (m,): a Fourier series, rows 1, cos, sin, cos 2, sin 2..."""
    for i in range(angle.size):
        s, c = _sincos(angle[i])
        _path_point(coefficients, c, s, out[i])


@compiled
def _scaled(value, scale, high):
    return min(max(np.float32(value / scale), -high), high)


@compiled_entry
def observe(
    state, summary, pose, coefficients, phase, turn, periods, lookahead, starts, scale, high, price, spent,
    observation, figures, first, end,
):  # fmt: skip
    """Fills observation (B, size) float32 and the rows FIGURES of figures, (9, B), for arms first..end-1.

    Args:
        state: the arms' state rows, (B, rows, n).
        summary: the arms' summary, (B, columns).
        pose: what joint angles are counted from [rad], (n,).
        coefficients: each arm's path as Fourier rows [m], (B, rows, 3).
        phase: where the target was on it at the reset [rad], (B,).
        turn: how far it turns in a control period [rad], (B,).
        periods: control periods since the reset, (B,).
        lookahead: angle from there to the look-ahead target [rad], (B,).
        starts: first entry of each of FEATURES in an observation, (7,).
        scale: quantity per unit of each entry, (size,).
        high: upper bounds of the entries, (size,).
        price: tracking weight [1/m], energy weight [1/W], control frequency [Hz], whether negative power counts.
        spent: energy paid so far [J], (B,), brought up to date.
        observation: filled.
        figures: filled.
        first: first arm.
        end: arm after the last.
    """
    n = state.shape[2]
    later = np.empty(3)
    target = np.empty(3)
    tracking_weight, energy_weight, frequency, regeneration = price
    for b in range(first, end):
        angle = phase[b] + turn[b] * periods[b]
        s, c = _sincos(angle)
        _path_point(coefficients[b], c, s, target)
        s_later, c_later = _sincos(angle + lookahead[b])
        _path_point(coefficients[b], c_later, s_later, later)
        for a in range(n):
            m = starts[0] + a
            observation[b, m] = _scaled(state[b, 0, a] - pose[a], scale[m], high[m])
            m = starts[1] + a
            observation[b, m] = _scaled(state[b, 1, a], scale[m], high[m])
            m = starts[2] + a
            observation[b, m] = _scaled(state[b, 2, a], scale[m], high[m])
        squared = 0.0
        for axis in range(3):
            hand = summary[b, HAND + axis]
            error = hand - target[axis]
            squared += error * error
            m = starts[3] + axis
            observation[b, m] = _scaled(error, scale[m], high[m])
            m = starts[4] + axis
            observation[b, m] = _scaled(hand - coefficients[b, 0, axis], scale[m], high[m])
            m = starts[5] + axis
            observation[b, m] = _scaled(hand - later[axis], scale[m], high[m])
        m = starts[6]
        observation[b, m] = _scaled(c, scale[m], high[m])
        observation[b, m + 1] = _scaled(s, scale[m + 1], high[m + 1])
        for row, meter in METERED:
            total = 0.0
            for a in range(n):
                total += state[b, meter, a]
            figures[row, b] = total
        paid = figures[2, b] if regeneration else figures[3, b]
        figures[0, b] = np.sqrt(squared)
        figures[1, b] = (paid - spent[b]) * frequency
        figures[5, b], figures[6, b], figures[8, b] = _reward(
            figures[0, b], figures[1, b], tracking_weight, energy_weight
        )
        figures[7, b] = summary[b, BELOW_TABLE]
        spent[b] = paid

"""Observations, rewards and points of paths of a batch of arms.

Compiled, so that an arm's bits do not depend on how many others there are.
"""

# pyright: basic

from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic

from elbow_gym.kernel import reward as plain
from elbow_gym.kernel.rows import AHEAD, BELOW_TABLE, HAND, METERED, PAID, PERIODS, PHASE, TURN
from elbow_gym.kernel.sine import sincos
from elbow_gym.kernel.template import common_copy, compiled, compiled_entry, renamed

_sincos = common_copy(sincos, compiled)


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
def _coordinate(coefficients, axis, c, s):
    value = coefficients[0, axis]
    ch, sh = c, s
    for h in range(1, coefficients.shape[0], 2):
        value += coefficients[h, axis] * ch + coefficients[h + 1, axis] * sh
        ch, sh = ch * c - sh * s, sh * c + ch * s
    return value


@compiled_entry
def path(coefficients, angle, out):
    """Points out (m, 3) of a closed path at angles (m,): a Fourier series, rows 1, cos, sin, cos 2, sin 2..."""
    for i in range(angle.size):
        s, c = _sincos(angle[i])
        for axis in range(3):
            out[i, axis] = _coordinate(coefficients, axis, c, s)


@compiled
def _put(observation, b, m, scales, value):
    high = np.float32(scales[1, m])
    observation[b, m] = min(max(np.float32(value / scales[0, m]), -high), high)


@compiled
def observe(
    state, summary, clock, task, path, pose, starts, scales, price, observation, figures, first, end,
):  # fmt: skip
    """Fills observation (B, size) float32 and the rows FIGURES of figures, (9, B), for arms first..end-1.

    Args:
        state: the arms' state rows, (B, rows, n).
        summary: the arms' summary, (B, columns).
        clock: steps and control periods since the reset, (B, 2).
        task: what each arm is to do, (B, TASK_COLUMNS); the energy paid is brought up to date.
        path: each arm's path as Fourier rows [m], (B, rows, 3).
        pose: what joint angles are counted from [rad], (n,).
        starts: first entry of each of FEATURES in an observation, (7,).
        scales: quantity per unit of each entry, and the entries' upper bounds, (2, size).
        price: tracking weight [1/m], energy weight [1/W], control frequency [Hz], 1 if negative power counts, (4,).
        observation: filled.
        figures: filled.
        first: first arm.
        end: arm after the last.
    """
    n = state.shape[2]
    for b in range(first, end):
        angle = task[b, PHASE] + task[b, TURN] * clock[b, PERIODS]
        s, c = _sincos(angle)
        s_later, c_later = _sincos(angle + task[b, AHEAD])
        for row in range(3):
            for a in range(n):
                value = state[b, row, a]
                if row == 0:
                    value -= pose[a]
                _put(observation, b, starts[row] + a, scales, value)
        squared = 0.0
        for axis in range(3):
            hand = summary[b, HAND + axis]
            error = hand - _coordinate(path[b], axis, c, s)
            squared += error * error
            _put(observation, b, starts[3] + axis, scales, error)
            _put(observation, b, starts[4] + axis, scales, hand - path[b, 0, axis])
            _put(observation, b, starts[5] + axis, scales, hand - _coordinate(path[b], axis, c_later, s_later))
        _put(observation, b, starts[6], scales, c)
        _put(observation, b, starts[6] + 1, scales, s)
        for row, meter in METERED:
            total = 0.0
            for a in range(n):
                total += state[b, meter, a]
            figures[row, b] = total
        paid = figures[2, b] if price[3] > 0.0 else figures[3, b]
        error = np.sqrt(squared)
        power = (paid - task[b, PAID]) * price[2]
        figures[0, b], figures[1, b] = error, power
        figures[5, b], figures[6, b], figures[8, b] = _reward(error, power, price[0], price[1])
        figures[7, b] = summary[b, BELOW_TABLE]
        task[b, PAID] = paid

"""Observations and rewards of a batch of arms.

Compiled, so that an arm's bits do not depend on how many others there are.
"""

# pyright: basic

from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic

from elbow_gym.kernel import reward as plain
from elbow_gym.kernel.path import coordinate, slope, turned
from elbow_gym.kernel.rows import (
    AHEAD, BELOW_TABLE, FURTHER, HAND, HORIZON, METERED, PAID, PERIODS, PHASE, RADIUS, ANGLE_RATE, TURN,
)  # fmt: skip
from elbow_gym.kernel.template import compiled, renamed


def _multiply_and_add(context, a, b, c):
    def generate(_, builder, __, values):
        return builder.fma(*values)

    return types.float64(types.float64, types.float64, types.float64), generate


_rounded_once: Any = intrinsic(_multiply_and_add)


def _fused(a, b, c):
    return _rounded_once(a, b, c)


_reward = compiled(
    renamed(plain.reward, {"fused": compiled(_fused) if hasattr(turned, "py_func") else plain.fused}, "reward")
)


@compiled
def _put(observation, b, m, scales, value):
    high = np.float32(scales[1, m])
    observation[b, m] = min(max(np.float32(value / scales[0, m]), -high), high)


@compiled
def _observe_task(observation, b, m, scales, task, path, angle, c, s, hand, periods):
    """Fills the entries from m on that say what the task is; `hand` is the row of the arm's summary."""
    for ahead in FURTHER:
        s_later, c_later = turned(angle + ahead * task[AHEAD])
        for axis in range(3):
            _put(observation, b, m, scales, hand[HAND + axis] - coordinate(path, axis, c_later, s_later))
            m += 1
    for axis in range(3):
        _put(observation, b, m, scales, task[ANGLE_RATE] * slope(path, axis, c, s))
        m += 1
    for column in range(RADIUS, HORIZON):
        _put(observation, b, m, scales, task[column])
        m += 1
    _put(observation, b, m, scales, 1.0 - periods / task[HORIZON])


@compiled
def observe(
    state, summary, clock, task, path, pose, starts, scales, price, observation, figures, first, end,
):  # fmt: skip
    """Fills observation (B, size) float32 and the rows FIGURES of figures, (9, B), for arms first..end-1.

    Args:
        state: the arms' state rows, (B, rows, n).
        summary: the arms' summary, (B, columns).
        clock: steps and control periods since the reset, (B, 2).
        task: what each arm is to do, (B, TASK_COLUMNS), or (B, OBSERVED_TASK_COLUMNS) where the task is observed; the
            energy paid is brought up to date.
        path: each arm's path as Fourier rows [m], (B, rows, 3).
        pose: what joint angles are counted from [rad], (n,).
        starts: first entry of each of FEATURES in an observation, (7,), and of the task where that is observed, (8,).
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
        s, c = turned(angle)
        s_later, c_later = turned(angle + task[b, AHEAD])
        for row in range(3):
            for a in range(n):
                value = state[b, row, a]
                if row == 0:
                    value -= pose[a]
                _put(observation, b, starts[row] + a, scales, value)
        squared = 0.0
        for axis in range(3):
            hand = summary[b, HAND + axis]
            error = hand - coordinate(path[b], axis, c, s)
            squared += error * error
            _put(observation, b, starts[3] + axis, scales, error)
            _put(observation, b, starts[4] + axis, scales, hand - path[b, 0, axis])
            _put(observation, b, starts[5] + axis, scales, hand - coordinate(path[b], axis, c_later, s_later))
        _put(observation, b, starts[6], scales, c)
        _put(observation, b, starts[6] + 1, scales, s)
        if starts.size > 7:
            _observe_task(
                observation, b, starts[7], scales, task[b], path[b], angle, c, s, summary[b], clock[b, PERIODS]
            )  # fmt: skip
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

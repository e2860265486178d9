"""Arms in and out of a block."""

# pyright: basic

import numpy as np

from elbow_gym.kernel.rows import (
    BELOW_TABLE, HAND, LARGEST_ANGLE, LOWEST, PARAMETER_ROWS, PLAIN_PARAMETER_ROWS, RESIDUAL, STATE_ROWS,
    SUMMARY_COLUMNS, SWITCHED_STATE_ROWS, VALID,
)  # fmt: skip
from elbow_gym.kernel.sine import sincos
from elbow_gym.kernel.slots import (
    ASTRAY, AXIAL, AZ, BELOW, CONTACT_LOSS, COPPER, CURRENT, DRIVE, ELECTRICAL, FORCES, FRICTION, LANES, LENGTH,
    LOWEST_Z,
    PSI_DOT, Q, Q_DOT, RHO, RUBBING, SHARED_ROWS, SPIN, STIFFNESS, STRIDE, SUMZ, SUPPLY_LOSS, TABLE, TEMPERATURE, U,
    VOLTAGE, W, WORK, YAW_INERTIA, Z,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template
def workspace(n):
    """Zeroed records of joints and tip, and a block's rows, on cache lines' edges, which vectors must not straddle."""
    whole = np.zeros((n + 1) * STRIDE + SHARED_ROWS + 8)
    edge = (-whole.ctypes.data % 64) // 8
    ws = whole[edge : edge + (n + 1) * STRIDE]
    return ws, whole[edge + (n + 1) * STRIDE : edge + (n + 1) * STRIDE + SHARED_ROWS]


@template
def gather(ws, n, start, state, parameters, voltage):
    """Lanes from arms start, start + 1, ...; lanes past the last arm repeat it and are never stored.

    Reads: Q_DOT, AXIAL.
    Writes: VOLTAGE, LENGTH, SPIN, YAW_INERTIA, LOWEST_Z, CONTACT_LOSS, STIFFNESS, PSI_DOT.
    """
    last = state.shape[0] - 1
    # Lanes innermost: they are stored side by side.
    for a in range(n):
        here = U(a * STRIDE)
        for row in range(STATE_ROWS):
            for lane in range(W):
                ws[here + U(row * W + lane)] = state[min(start + lane, last), row, a]
        for lane in range(W):
            ws[here + VOLTAGE + U(lane)] = voltage[min(start + lane, last), a]
        for row in range(PLAIN_PARAMETER_ROWS):
            for lane in range(W):
                ws[here + LENGTH + U(row * W + lane)] = parameters[min(start + lane, last), row, a]
        if TABLE or RUBBING or DRIVE:
            for row in range(3):
                for lane in range(W):
                    ws[here + CONTACT_LOSS + U(row * W + lane)] = state[min(start + lane, last), STATE_ROWS + row, a]
            for row in range(PARAMETER_ROWS - PLAIN_PARAMETER_ROWS):
                for lane in range(W):
                    offset = STIFFNESS + U(row * W + lane)
                    ws[here + offset] = parameters[min(start + lane, last), PLAIN_PARAMETER_ROWS + row, a]
    for k in range(LANES):
        ws[SPIN + k] = ws[Q_DOT + k] * ws[Q_DOT + k]
        if TABLE:
            ws[PSI_DOT + k] = ws[Q_DOT + k]
        ws[YAW_INERTIA + k] = ws[AXIAL + k]
        ws[LOWEST_Z + k] = np.inf


@template
def scatter(ws, shared, n, lane, elbows, out, summary):
    """Writes a lane back; a state that cannot be represented stays as it was, with VALID at zero.

    Reads: Q, Q_DOT, CURRENT, ELECTRICAL, COPPER, FRICTION, WORK, RHO, SUMZ, Z, LOWEST_Z, CONTACT_LOSS, TEMPERATURE,
        SUPPLY_LOSS, AZ, FORCES, BELOW, ASTRAY.
    """
    k = U(lane)
    valid = True
    for a in range(n):
        here = U(a * STRIDE) + k
        # Not-a-number and infinity fail the comparison or turn the product into not-a-number.
        meters = ws[here + ELECTRICAL] + ws[here + COPPER] + ws[here + FRICTION] + ws[here + WORK]
        if TABLE or RUBBING or DRIVE:
            meters += ws[here + CONTACT_LOSS] + ws[here + TEMPERATURE] + ws[here + SUPPLY_LOSS]
        valid = valid and abs(ws[here + Q]) + 0.0 * (ws[here + Q_DOT] + ws[here + CURRENT] + meters) < LARGEST_ANGLE
    summary[VALID] = 1.0 if valid else 0.0
    if not valid:
        return False
    for a in range(n):
        here = U(a * STRIDE) + k
        for row in range(STATE_ROWS):
            out[row, a] = ws[here + U(row * W)]
        if TABLE or RUBBING or DRIVE:
            for row in range(SWITCHED_STATE_ROWS - STATE_ROWS):
                out[STATE_ROWS + row, a] = ws[here + CONTACT_LOSS + U(row * W)]
    end = U((n - 1) * STRIDE) + k
    s, c = sincos(ws[Q + k])
    summary[HAND] = ws[end + RHO] * c
    summary[HAND + 1] = ws[end + RHO] * s
    summary[HAND + 2] = ws[end + Z]
    summary[LOWEST] = ws[end + LOWEST_Z]
    summary[BELOW_TABLE] += shared[BELOW + k]
    summary[RESIDUAL] = shared[ASTRAY + k]
    for j in range(elbows.size):
        elbow = U((elbows[j] - 2) * STRIDE) + k
        summary[RESIDUAL] = max(summary[RESIDUAL], abs(ws[elbow + AZ] + ws[elbow + SUMZ]))
        summary[SUMMARY_COLUMNS + j] = shared[FORCES + U(j * W) + k]
    return True

"""Forces of the rigid elbows."""

# pyright: basic

from elbow_gym.kernel.dense import cholesky_solve
from elbow_gym.kernel.elbow_friction import friction_fixed_point, measure_jam
from elbow_gym.kernel.rows import MAXIMUM_ELBOWS
from elbow_gym.kernel.slots import (
    C3, CR, CZ, D, ER, EZ, FORCES, FREE, GAIN, IR3, IZ3, LANES, NEXT, R, ROTOR, RUBBING, STRIDE, SUMZ, U, W, Y,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template
def elbow_forces(ws, shared, n, elbows):
    """Elbow forces: f = -W^-1 z_ddot_free, with W = sum of d y y^T and z_ddot_free = sum of d y r + J_dot q_dot.

    y is the recursion's answer to a unit +z force at an elbow; the forces then add sum of y f to r.

    Reads: ROTOR, SUMZ, ER, EZ, D, FREE, GAIN, IR3, IZ3, R, CR, CZ, C3, Y, FORCES.
    Writes: FREE, GAIN, R, CR, CZ, C3, Y, FORCES.
    """
    # An opaque trip count: LLVM would unroll short bodies of a known one into scalar code.
    lanes = min(LANES, U(ws.size))
    for j in range(elbows.size):
        last = elbows[j] - 2
        y_slot = U(Y + j * W)
        row = U(j * MAXIMUM_ELBOWS * W)
        here = U(last * STRIDE)
        child = here + NEXT
        for k in range(lanes):
            ws[child + CR + k] = 0.0
            ws[child + CZ + k] = -1.0
            ws[child + C3 + k] = 0.0
            ws[child + FREE + k] = ws[here + SUMZ + k]
            ws[child + GAIN + k] = 0.0
        for a in range(last, 0, -1):
            here = U(a * STRIDE)
            child = here + NEXT
            for k in range(LANES):
                cr = ws[child + CR + k]
                cz = ws[child + CZ + k]
                y = -((ws[here + ER + k] * cr + ws[here + EZ + k] * cz) + ws[child + C3 + k])
                dy = ws[here + D + k] * y
                ws[here + CR + k] = cr + dy * ws[here + IR3 + k]
                ws[here + CZ + k] = cz + dy * ws[here + IZ3 + k]
                ws[here + C3 + k] = -ws[here + ROTOR + k] * dy
                ws[here + FREE + k] = ws[child + FREE + k] + dy * ws[here + R + k]
                ws[here + GAIN + k] = ws[child + GAIN + k] + dy * y
                ws[here + y_slot + k] = y
        for k in range(lanes):
            shared[row + U(j * W) + k] = ws[NEXT + GAIN + k]
            shared[FORCES + U(j * W) + k] = ws[NEXT + FREE + k]
        for i in range(j):
            other = U(Y + i * W)
            entry = row + U(i * W)
            for k in range(lanes):
                shared[entry + k] = 0.0
            for a in range(1, elbows[i] - 1):
                here = U(a * STRIDE)
                for k in range(lanes):
                    shared[entry + k] += ws[here + D + k] * ws[here + y_slot + k] * ws[here + other + k]
    if RUBBING:
        friction_fixed_point(ws, shared, n, elbows)
    cholesky_solve(shared, lanes, elbows.size)
    if RUBBING:
        measure_jam(shared, lanes, elbows.size)
    for j in range(elbows.size):
        y_slot = U(Y + j * W)
        force = FORCES + U(j * W)
        for a in range(1, elbows[j] - 1):
            here = U(a * STRIDE)
            for k in range(lanes):
                ws[here + R + k] += ws[here + y_slot + k] * shared[force + k]

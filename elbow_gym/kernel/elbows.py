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
    # An opaque trip count: LLVM would unroll short bodies of a known one into scalar code. One lane is scalar anyway,
    # and what it would prepare for more is much to compile.
    lanes = LANES if W == 1 else min(LANES, U(ws.size))
    for j in range(elbows.size):
        last = elbows[j] - 2
        y_slot = U(Y + j * W)
        row = U(j * MAXIMUM_ELBOWS * W)
        record = U(last * STRIDE)
        for k in range(lanes):
            here = record + k
            child = here + NEXT
            ws[child + CR] = 0.0
            ws[child + CZ] = -1.0
            ws[child + C3] = 0.0
            ws[child + FREE] = ws[here + SUMZ]
            ws[child + GAIN] = 0.0
        for a in range(last, 0, -1):
            record = U(a * STRIDE)
            for k in range(LANES):
                here = record + k
                child = here + NEXT
                cr = ws[child + CR]
                cz = ws[child + CZ]
                y = -((ws[here + ER] * cr + ws[here + EZ] * cz) + ws[child + C3])
                dy = ws[here + D] * y
                ws[here + CR] = cr + dy * ws[here + IR3]
                ws[here + CZ] = cz + dy * ws[here + IZ3]
                ws[here + C3] = -ws[here + ROTOR] * dy
                ws[here + FREE] = ws[child + FREE] + dy * ws[here + R]
                ws[here + GAIN] = ws[child + GAIN] + dy * y
                ws[here + y_slot] = y
        for k in range(lanes):
            shared[row + U(j * W) + k] = ws[NEXT + GAIN + k]
            shared[FORCES + U(j * W) + k] = ws[NEXT + FREE + k]
        for i in range(j):
            other = U(Y + i * W)
            entry = row + U(i * W)
            for k in range(lanes):
                shared[entry + k] = 0.0
            for a in range(1, elbows[i] - 1):
                record = U(a * STRIDE)
                for k in range(lanes):
                    here = record + k
                    shared[entry + k] += ws[here + D] * ws[here + y_slot] * ws[here + other]
    if RUBBING:
        friction_fixed_point(ws, shared, n, elbows)
    cholesky_solve(shared, lanes, elbows.size)
    if RUBBING:
        measure_jam(shared, lanes, elbows.size)
    for j in range(elbows.size):
        y_slot = U(Y + j * W)
        force = FORCES + U(j * W)
        for a in range(1, elbows[j] - 1):
            record = U(a * STRIDE)
            for k in range(lanes):
                here = record + k
                ws[here + R] += ws[here + y_slot] * shared[force + k]

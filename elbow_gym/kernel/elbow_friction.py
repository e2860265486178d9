"""Friction under rigid elbows, and elbow forces that agree with it: one fixed point, in the order of its steps."""

# pyright: basic

import numpy as np

from elbow_gym.kernel.dense import cholesky_solve, gauss_solve
from elbow_gym.kernel.rows import ELBOW_SPEED, LARGEST_AMPLIFICATION, MAXIMUM_ELBOWS, RESOLVED_FRICTION
from elbow_gym.kernel.slots import (
    ASTRAY, C3, COME_UP, COUPLING, CR, CZ, D, ELBOW_FRICTION, ER, EZ, FORCES, FREE_RISE, IR3, IZ3, LANES, LOSS, MATRIX,
    MOBILITY, NEXT, PAYLOAD, PUSH, PUSHING, PUSH_LIMIT, Q_DOT, R, RADIAL_RISE, RHO, RHO_DOT, ROTOR, SLIDE_R, SLIDE_T,
    STEP, STRIDE, TABLE, TWIST, U, W, X, Y, YAW_INERTIA,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template
def friction_response(ws, shared, lanes, tip, elbow, j):
    """x, the recursion's answer to a unit radial force at an elbow, and the elbow's mobility: what a newton moves it.

    The mobility [1/kg] is the larger of those along the radius and across it, by the yaw.

    Reads: PAYLOAD, RHO, YAW_INERTIA, ROTOR, ER, EZ, D, IR3, IZ3, CR, CZ, C3, MOBILITY.
    Writes: CR, CZ, C3, X, MOBILITY.
    """
    record = U((elbow - 2) * STRIDE)
    mobility = MOBILITY + U(j * W)
    for k in range(lanes):
        child = record + k + NEXT
        ws[child + CR] = -1.0
        ws[child + CZ] = 0.0
        ws[child + C3] = 0.0
        shared[mobility + k] = 0.0
    for a in range(elbow - 2, 0, -1):
        record = U(a * STRIDE)
        for k in range(lanes):
            here = record + k
            child = here + NEXT
            cr = ws[child + CR]
            cz = ws[child + CZ]
            x = -((ws[here + ER] * cr + ws[here + EZ] * cz) + ws[child + C3])
            dx = ws[here + D] * x
            ws[here + CR] = cr + dx * ws[here + IR3]
            ws[here + CZ] = cz + dx * ws[here + IZ3]
            ws[here + C3] = -ws[here + ROTOR] * dx
            ws[here + U(X + j * W)] = x
            shared[mobility + k] += dx * x
    record = U((elbow - 2) * STRIDE)
    for k in range(lanes):
        end = tip + k
        inertia = ws[end + YAW_INERTIA] + ws[end + PAYLOAD] * ws[end + RHO] * ws[end + RHO] + ws[ROTOR + k]
        rho = ws[record + k + RHO]
        shared[mobility + k] = max(shared[mobility + k], rho * rho / inertia)


@template
def friction_coupling(ws, shared, lanes, tip, elbows):
    """Keeps the matrix and the free accelerations, and finds what a radial newton at j adds to the rise at i.

    Reads: D, Y, X, FORCES, RADIAL_RISE.
    Writes: MATRIX, RADIAL_RISE, FREE_RISE.
    """
    p = elbows.size
    for j in range(p):
        friction_response(ws, shared, lanes, tip, elbows[j], j)
    for j in range(p):
        for k in range(lanes):
            shared[FREE_RISE + U(j * W) + k] = shared[FORCES + U(j * W) + k]
        for i in range(p):
            entry = U((i * MAXIMUM_ELBOWS + j) * W)
            symmetric = U((max(i, j) * MAXIMUM_ELBOWS + min(i, j)) * W)
            for k in range(lanes):
                shared[MATRIX + entry + k] = shared[symmetric + k]
                shared[RADIAL_RISE + entry + k] = 0.0
            for a in range(1, min(elbows[i], elbows[j]) - 1):
                record = U(a * STRIDE)
                for k in range(lanes):
                    here = record + k
                    answer = ws[here + U(Y + i * W)]
                    shared[RADIAL_RISE + entry + k] += ws[here + D] * answer * ws[here + U(X + j * W)]


@template
def friction_law(ws, shared, lanes, elbows):
    """Friction for a newton of each elbow's force, radial and tangential, and what that adds to the matrix.

    It is mu v / sqrt(v^2 + v_s^2) against the sliding velocity v. The speed v_s over which it comes up is ELBOW_SPEED,
    and more where forces are so large that the friction of a slow elbow, mu f M / v_s times the step with M the
    mobility, would be beyond what a step resolves: between two links that fold up, elbows push without bound.

    Reads: Q_DOT, RHO, RHO_DOT, ELBOW_FRICTION, FORCES, MOBILITY, STEP, COME_UP, RADIAL_RISE, SLIDE_R.
    Writes: COME_UP, SLIDE_R, SLIDE_T, COUPLING.
    """
    p = elbows.size
    for k in range(lanes):
        shared[COME_UP + k] = 0.0
    for j in range(p):
        record = U((elbows[j] - 2) * STRIDE)
        for k in range(lanes):
            push = ws[record + k + ELBOW_FRICTION] * max(shared[FORCES + U(j * W) + k], 0.0)
            shared[COME_UP + k] += push * shared[MOBILITY + U(j * W) + k]
    for k in range(lanes):
        shared[COME_UP + k] = max(ELBOW_SPEED, shared[COME_UP + k] * shared[STEP + k] / RESOLVED_FRICTION)
    for j in range(p):
        record = U((elbows[j] - 2) * STRIDE)
        for k in range(lanes):
            here = record + k
            radial = ws[here + RHO_DOT]
            tangential = ws[here + RHO] * ws[Q_DOT + k]
            come_up = shared[COME_UP + k]
            share = -ws[here + ELBOW_FRICTION] / np.sqrt(radial * radial + tangential * tangential + come_up * come_up)
            shared[SLIDE_R + U(j * W) + k] = share * radial
            shared[SLIDE_T + U(j * W) + k] = share * tangential
        for i in range(p):
            entry = U((i * MAXIMUM_ELBOWS + j) * W)
            for k in range(lanes):
                shared[COUPLING + entry + k] = shared[RADIAL_RISE + entry + k] * shared[SLIDE_R + U(j * W) + k]


@template
def apply_friction(ws, shared, lanes, tip, elbows):
    """Adds the friction that was found to the bias, and its loss to the meters; the normal forces are left to solve.

    Reads: Q_DOT, RHO, RHO_DOT, TWIST, LOSS, R, X, FORCES, MATRIX, COUPLING, FREE_RISE, SLIDE_R, SLIDE_T, PUSH,
        PUSH_LIMIT.
    Writes: TWIST, LOSS, R, FORCES, PUSH.
    """
    p = elbows.size
    for j in range(p):
        for k in range(lanes):
            shared[PUSH + U(j * W) + k] = min(max(shared[FORCES + U(j * W) + k], 0.0), shared[PUSH_LIMIT + k])
    for i in range(p):
        for k in range(lanes):
            shared[FORCES + U(i * W) + k] = shared[FREE_RISE + U(i * W) + k]
        for j in range(p):
            entry = U((i * MAXIMUM_ELBOWS + j) * W)
            for k in range(lanes):
                shared[entry + k] = shared[MATRIX + entry + k]
                shared[FORCES + U(i * W) + k] += shared[COUPLING + entry + k] * shared[PUSH + U(j * W) + k]
    for j in range(p):
        x_slot = U(X + j * W)
        for a in range(1, elbows[j] - 1):
            record = U(a * STRIDE)
            for k in range(lanes):
                here = record + k
                ws[here + R] += ws[here + x_slot] * (shared[SLIDE_R + U(j * W) + k] * shared[PUSH + U(j * W) + k])
        record = U((elbows[j] - 2) * STRIDE)
        for k in range(lanes):
            here = record + k
            radial = shared[SLIDE_R + U(j * W) + k] * shared[PUSH + U(j * W) + k]
            tangential = shared[SLIDE_T + U(j * W) + k] * shared[PUSH + U(j * W) + k]
            lost = -(radial * ws[here + RHO_DOT] + tangential * ws[here + RHO] * ws[Q_DOT + k])
            ws[here + LOSS] = ws[here + LOSS] + lost if TABLE else lost
            ws[tip + TWIST + k] += tangential * ws[here + RHO]


@template
def friction_fixed_point(ws, shared, n, elbows):
    """Friction of the elbows that push, and elbow forces that agree with it.

    Friction enters the columns of the active elbows, at first those that push without friction, then those that push
    with it, until they stay the same; the friction found is then held, so that it opposes the sliding in any case.

    Reads: FORCES, PUSHING, PUSH_LIMIT.
    Writes: TWIST, PUSHING, PUSH_LIMIT.
    """
    # As in `elbow_forces`.
    lanes = LANES if W == 1 else min(LANES, U(ws.size))
    p = elbows.size
    tip = U((n - 1) * STRIDE)
    if not TABLE:
        for k in range(lanes):
            ws[tip + TWIST + k] = 0.0
    friction_coupling(ws, shared, lanes, tip, elbows)
    cholesky_solve(shared, lanes, p)
    friction_law(ws, shared, lanes, elbows)
    for k in range(lanes):
        shared[PUSH_LIMIT + k] = 0.0
    for j in range(p):
        for k in range(lanes):
            force = LARGEST_AMPLIFICATION * abs(shared[FORCES + U(j * W) + k])
            shared[PUSH_LIMIT + k] = max(shared[PUSH_LIMIT + k], force)
    for _ in range(p + 2):
        for j in range(p):
            for k in range(lanes):
                shared[PUSHING + U(j * W) + k] = 1.0 if shared[FORCES + U(j * W) + k] > 0.0 else 0.0
        gauss_solve(shared, lanes, p)
        changed = 0.0
        for j in range(p):
            for k in range(lanes):
                pushes = 1.0 if shared[FORCES + U(j * W) + k] > 0.0 else 0.0
                changed = max(changed, abs(pushes - shared[PUSHING + U(j * W) + k]))
        if changed == 0.0:
            break
    apply_friction(ws, shared, lanes, tip, elbows)


@template
def measure_jam(shared, lanes, p):
    """What the friction that was applied is short of Coulomb's law for the forces that were found, in acceleration.

    Zero but where friction jams an arm: where the law has no solution, or one without bound.

    Reads: FORCES, COUPLING, PUSH, ASTRAY.
    Writes: ASTRAY.
    """
    for i in range(p):
        for k in range(lanes):
            short = 0.0
            for j in range(p):
                force = max(shared[FORCES + U(j * W) + k], 0.0)
                rise = shared[COUPLING + U((i * MAXIMUM_ELBOWS + j) * W) + k]
                short += rise * (force - shared[PUSH + U(j * W) + k])
            shared[ASTRAY + k] = max(shared[ASTRAY + k], abs(short))

"""Poses and rates back onto the elbows' plane after a step."""

# pyright: basic

from elbow_gym.kernel.rows import NEWTON_STEPS, SMALL_SHIFT
from elbow_gym.kernel.sine import sincos
from elbow_gym.kernel.slots import (
    ACTIVE, DRIFT, ER, GRAM, HEIGHT, LANES, LENGTH, NEXT, OMEGA, PHI, Q, Q_DOT, RATE, SHIFT, STRIDE, U, W,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template(flat=True)
def projection_step(ws, shared, elbows):
    """One step of `project` in the active lanes; those stay active that it has moved far.

    All elbows lie at z = 0, so the links between two neighbours close on their own and no matrix is solved.

    Reads: Q, Q_DOT, LENGTH, PHI, OMEGA, ER, HEIGHT, RATE, GRAM, SHIFT, ACTIVE, DRIFT.
    Writes: Q, Q_DOT, PHI, OMEGA, ER, HEIGHT, RATE, GRAM, SHIFT, ACTIVE, DRIFT.
    """
    lanes = LANES if W == 1 else min(LANES, U(ws.size))
    first = 1
    for k in range(lanes):
        shared[SHIFT + k] = 0.0
    for j in range(elbows.size):
        last = elbows[j] - 2
        record = U((first - 1) * STRIDE)
        for k in range(lanes):
            here = record + k
            ws[here + HEIGHT] = 0.0
            ws[here + RATE] = 0.0
            # A floor far below any real lever arm keeps a segment that stands upright finite.
            ws[here + GRAM] = 1e-12
        for a in range(first, last + 1):
            record = U(a * STRIDE)
            for k in range(LANES):
                here = record + k
                parent = here - NEXT
                phi = ws[parent + PHI] + ws[here + Q]
                omega = ws[parent + OMEGA] + ws[here + Q_DOT]
                s, c = sincos(phi)
                length = ws[here + LENGTH]
                ls = length * s
                ws[here + PHI] = phi
                ws[here + OMEGA] = omega
                ws[here + HEIGHT] = ws[parent + HEIGHT] + length * c
                ws[here + RATE] = ws[parent + RATE] - ls * omega
                ws[here + GRAM] = ws[parent + GRAM] + ls * ls
                ws[here + ER] = ls
        record = U(last * STRIDE)
        for k in range(lanes):
            here = record + k
            shared[DRIFT + k] = max(shared[DRIFT + k], shared[ACTIVE + k] * abs(ws[here + RATE]))
            scale = shared[ACTIVE + k] / ws[here + GRAM]
            height = ws[here + HEIGHT] * scale
            rate = ws[here + RATE] * scale
            ws[here + HEIGHT] = height
            ws[here + RATE] = rate
            # The next segment counts its pitch from here, and its first joint is about to take the shift back.
            ws[here + PHI] += ws[here + ER] * height
            ws[here + OMEGA] += ws[here + ER] * rate
            shared[SHIFT + k] = max(shared[SHIFT + k], abs(height))
        # Tip to base: a link's own absolute shift, which the link after it takes back from its relative angle.
        for a in range(last, first - 1, -1):
            record = U(a * STRIDE)
            for k in range(LANES):
                here = record + k
                parent = here - NEXT
                child = here + NEXT
                height = ws[here + HEIGHT]
                rate = ws[here + RATE]
                shift = ws[here + ER] * height
                kick = ws[here + ER] * rate
                ws[parent + HEIGHT] = height
                ws[parent + RATE] = rate
                ws[here + Q] += shift
                ws[here + Q_DOT] += kick
                ws[child + Q] -= shift
                ws[child + Q_DOT] -= kick
        first = last + 1
    for k in range(lanes):
        shared[ACTIVE + k] = 1.0 if shared[SHIFT + k] > SMALL_SHIFT else 0.0


@template
def project(ws, shared, elbows):
    """Newton steps of pose and rates onto the elbows' plane, least change of absolute pitch.

    Mostly one step: the drift is the integrator's local error, whose square is below rounding. Near a segment that is
    upright it takes more. A lane stops by its own shift, so its bits do not depend on its neighbours'.

    Reads: ACTIVE.
    Writes: ACTIVE, DRIFT.
    """
    lanes = LANES if W == 1 else min(LANES, U(ws.size))
    for k in range(lanes):
        shared[ACTIVE + k] = 1.0
        shared[DRIFT + k] = 0.0
    for _ in range(NEWTON_STEPS):
        projection_step(ws, shared, elbows)
        moving = 0.0
        for k in range(lanes):
            moving = max(moving, shared[ACTIVE + k])
        if moving == 0.0:
            break

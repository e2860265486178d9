"""Poses and rates back onto the elbows' plane after a step."""

# pyright: basic

from elbow_gym.kernel.rows import NEWTON_STEPS, SMALL_SHIFT
from elbow_gym.kernel.sine import sincos
from elbow_gym.kernel.slots import (
    ACTIVE, ER, GRAM, HEIGHT, LANES, LENGTH, NEXT, OMEGA, PHI, Q, Q_DOT, RATE, SHIFT, STRIDE, U,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template
def projection_step(ws, shared, elbows):
    """One step of `project` in the active lanes; those stay active that it has moved far.

    All elbows lie at z = 0, so the links between two neighbours close on their own and no matrix is solved.

    Reads: Q, Q_DOT, LENGTH, PHI, OMEGA, ER, HEIGHT, RATE, GRAM, SHIFT, ACTIVE.
    Writes: Q, Q_DOT, PHI, OMEGA, ER, HEIGHT, RATE, GRAM, SHIFT, ACTIVE.
    """
    lanes = min(LANES, U(ws.size))
    first = 1
    for k in range(lanes):
        shared[SHIFT + k] = 0.0
    for j in range(elbows.size):
        last = elbows[j] - 2
        here = U((first - 1) * STRIDE)
        for k in range(lanes):
            ws[here + HEIGHT + k] = 0.0
            ws[here + RATE + k] = 0.0
            # A floor far below any real lever arm keeps a segment that stands upright finite.
            ws[here + GRAM + k] = 1e-12
        for a in range(first, last + 1):
            here = U(a * STRIDE)
            parent = here - NEXT
            for k in range(LANES):
                phi = ws[parent + PHI + k] + ws[here + Q + k]
                omega = ws[parent + OMEGA + k] + ws[here + Q_DOT + k]
                s, c = sincos(phi)
                length = ws[here + LENGTH + k]
                ls = length * s
                ws[here + PHI + k] = phi
                ws[here + OMEGA + k] = omega
                ws[here + HEIGHT + k] = ws[parent + HEIGHT + k] + length * c
                ws[here + RATE + k] = ws[parent + RATE + k] - ls * omega
                ws[here + GRAM + k] = ws[parent + GRAM + k] + ls * ls
                ws[here + ER + k] = ls
        here = U(last * STRIDE)
        for k in range(lanes):
            scale = shared[ACTIVE + k] / ws[here + GRAM + k]
            height = ws[here + HEIGHT + k] * scale
            rate = ws[here + RATE + k] * scale
            ws[here + HEIGHT + k] = height
            ws[here + RATE + k] = rate
            # The next segment counts its pitch from here, and its first joint is about to take the shift back.
            ws[here + PHI + k] += ws[here + ER + k] * height
            ws[here + OMEGA + k] += ws[here + ER + k] * rate
            shared[SHIFT + k] = max(shared[SHIFT + k], abs(height))
        # Tip to base: a link's own absolute shift, which the link after it takes back from its relative angle.
        for a in range(last, first - 1, -1):
            here = U(a * STRIDE)
            parent = here - NEXT
            child = here + NEXT
            for k in range(LANES):
                height = ws[here + HEIGHT + k]
                rate = ws[here + RATE + k]
                shift = ws[here + ER + k] * height
                kick = ws[here + ER + k] * rate
                ws[parent + HEIGHT + k] = height
                ws[parent + RATE + k] = rate
                ws[here + Q + k] += shift
                ws[here + Q_DOT + k] += kick
                ws[child + Q + k] -= shift
                ws[child + Q_DOT + k] -= kick
        first = last + 1
    for k in range(lanes):
        shared[ACTIVE + k] = 1.0 if shared[SHIFT + k] > SMALL_SHIFT else 0.0


@template
def project(ws, shared, elbows):
    """Newton steps of pose and rates onto the elbows' plane, least change of absolute pitch.

    Mostly one step: the drift is the integrator's local error, whose square is below rounding. Near a segment that is
    upright it takes more. A lane stops by its own shift, so its bits do not depend on its neighbours'.

    Reads: ACTIVE.
    Writes: ACTIVE.
    """
    lanes = min(LANES, U(ws.size))
    for k in range(lanes):
        shared[ACTIVE + k] = 1.0
    for _ in range(NEWTON_STEPS):
        projection_step(ws, shared, elbows)
        moving = 0.0
        for k in range(lanes):
            moving = max(moving, shared[ACTIVE + k])
        if moving == 0.0:
            break

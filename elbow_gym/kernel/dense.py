"""Small dense systems, one per lane: Cholesky for elbow forces, Gauss where friction makes them unsymmetric."""

# pyright: basic

import numpy as np

from elbow_gym.kernel.rows import MAXIMUM_ELBOWS
from elbow_gym.kernel.slots import COUPLING, FORCES, FREE_RISE, MATRIX, PUSHING, U, W
from elbow_gym.kernel.template import template


@template(flat=True)
def cholesky_solve(shared, lanes, p):
    """Elbow forces -W^-1 f in place of f, by Cholesky W = L L^T in place; the diagonal then holds 1 / L_jj.

    Reads: FORCES.
    Writes: FORCES.
    """
    for j in range(p):
        row = U(j * MAXIMUM_ELBOWS * W)
        force = FORCES + U(j * W)
        diagonal = row + U(j * W)
        for i in range(j):
            other = U(i * MAXIMUM_ELBOWS * W)
            entry = row + U(i * W)
            for m in range(i):
                for k in range(lanes):
                    shared[entry + k] -= shared[row + U(m * W) + k] * shared[other + U(m * W) + k]
            for k in range(lanes):
                shared[entry + k] *= shared[other + U(i * W) + k]
        for m in range(j):
            for k in range(lanes):
                lower = shared[row + U(m * W) + k]
                shared[diagonal + k] -= lower * lower
                shared[force + k] -= lower * shared[FORCES + U(m * W) + k]
        for k in range(lanes):
            # Elbows that cannot move against each other leave nothing to solve for: the floor keeps that finite.
            inverse = 1.0 / np.sqrt(max(shared[diagonal + k], 1e-12))
            shared[diagonal + k] = inverse
            shared[force + k] *= inverse
    for j in range(p - 1, -1, -1):
        force = FORCES + U(j * W)
        diagonal = U((j * MAXIMUM_ELBOWS + j) * W)
        for m in range(j + 1, p):
            entry = U((m * MAXIMUM_ELBOWS + j) * W)
            for k in range(lanes):
                # Forces already solved carry their final minus sign.
                shared[force + k] += shared[entry + k] * shared[FORCES + U(m * W) + k]
        for k in range(lanes):
            shared[force + k] *= -shared[diagonal + k]


@template
def gauss_solve(shared, lanes, p):
    """Elbow forces with the friction of those that push: Gauss on the matrix and what friction adds to it.

    Reads: FORCES, MATRIX, COUPLING, FREE_RISE, PUSHING.
    Writes: FORCES.
    """
    for i in range(p):
        for k in range(lanes):
            shared[FORCES + U(i * W) + k] = -shared[FREE_RISE + U(i * W) + k]
        for j in range(p):
            entry = U((i * MAXIMUM_ELBOWS + j) * W)
            for k in range(lanes):
                rubbing = shared[PUSHING + U(j * W) + k] * shared[COUPLING + entry + k]
                shared[entry + k] = shared[MATRIX + entry + k] + rubbing
    for j in range(p):
        pivot = U((j * MAXIMUM_ELBOWS + j) * W)
        for i in range(j + 1, p):
            lead = U((i * MAXIMUM_ELBOWS + j) * W)
            for k in range(lanes):
                shared[lead + k] /= shared[pivot + k]
                shared[FORCES + U(i * W) + k] -= shared[lead + k] * shared[FORCES + U(j * W) + k]
            for m in range(j + 1, p):
                entry = U((i * MAXIMUM_ELBOWS + m) * W)
                above = U((j * MAXIMUM_ELBOWS + m) * W)
                for k in range(lanes):
                    shared[entry + k] -= shared[lead + k] * shared[above + k]
    for j in range(p - 1, -1, -1):
        force = FORCES + U(j * W)
        for m in range(j + 1, p):
            entry = U((j * MAXIMUM_ELBOWS + m) * W)
            for k in range(lanes):
                shared[force + k] -= shared[entry + k] * shared[FORCES + U(m * W) + k]
        for k in range(lanes):
            shared[force + k] /= shared[U((j * MAXIMUM_ELBOWS + j) * W) + k]

"""Entries beside runs: accelerations, and poses on the elbows' plane."""

# pyright: basic

from elbow_gym.kernel.acceleration import accelerate
from elbow_gym.kernel.block import gather, workspace
from elbow_gym.kernel.integration import evaluate
from elbow_gym.kernel.projection import project
from elbow_gym.kernel.slots import (
    CURRENT, DRIVE, FORCES, INVERSE_L, LENGTH, NET, Q, Q_DDOT, RESISTANCE, STRIDE, TEMPERATURE, U, W,
    WARMING,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template(entry=True)
def accelerations(state, parameters, voltage, elbows, q_ddot, current_dot, elbow_force):
    """Right-hand side of eq. 17 at each arm's state: q_ddot and current_dot (B, n), elbow_force (B, p).

    Reads: CURRENT, RESISTANCE, INVERSE_L, Q_DDOT, NET, TEMPERATURE, WARMING, FORCES.
    """
    n = state.shape[2]
    ws, shared = workspace(n)
    for start in range(0, state.shape[0], W):
        gather(ws, n, start, state, parameters, voltage)
        evaluate(ws, shared, n, elbows)
        accelerate(ws, n, 0.0)
        for lane in range(min(W, state.shape[0] - start)):
            for a in range(n):
                here = U(a * STRIDE + lane)
                resistance = ws[here + RESISTANCE]
                if DRIVE:
                    resistance *= 1.0 + ws[here + WARMING] * ws[here + TEMPERATURE]
                q_ddot[start + lane, a] = ws[here + Q_DDOT]
                current_dot[start + lane, a] = (ws[here + NET] - resistance * ws[here + CURRENT]) * ws[here + INVERSE_L]
            for j in range(elbows.size):
                elbow_force[start + lane, j] = shared[FORCES + U(j * W + lane)]


@template(entry=True)
def project_poses(q, parameters, elbows):
    """Moves poses q [rad], (B, n), onto the elbows' plane in place, as far as Newton's method gets.

    Reads: Q.
    Writes: Q, LENGTH.
    """
    n = q.shape[1]
    ws, shared = workspace(n)
    for start in range(0, q.shape[0], W):
        for lane in range(W):
            arm = min(start + lane, q.shape[0] - 1)
            for a in range(n):
                ws[U(a * STRIDE + lane) + Q] = q[arm, a]
                ws[U(a * STRIDE + lane) + LENGTH] = parameters[arm, 0, a]
        project(ws, shared, elbows)
        for lane in range(min(W, q.shape[0] - start)):
            for a in range(n):
                q[start + lane, a] = ws[U(a * STRIDE + lane) + Q]

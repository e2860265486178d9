"""What Python calls: a run, accelerations at a state, poses laid onto the table."""

# pyright: basic

from elbow_gym.kernel.block import gather, scatter, workspace
from elbow_gym.kernel.integration import evaluate, first_stage, rk4_step
from elbow_gym.kernel.projection import project
from elbow_gym.kernel.slots import BELOW, CURRENT_SUM, FORCES, LANES, LENGTH, Q, Q_DOT_SUM, STRIDE, U, W
from elbow_gym.kernel.template import template


@template(entry=True)
def advance(state, parameters, voltage, elbows, first, end, n_steps, step, summary):
    """Arms first..end-1 of the batch, n_steps RK4 steps of `step` seconds under constant voltage, in place.

    state (B, STATE_ROWS, n), parameters (B, PARAMETER_ROWS, n), voltage (B, n), summary (B, SUMMARY_COLUMNS + p).
    With n_steps = 0 only the summary is refreshed. An arm whose state leaves the representable keeps its old
    state and summary, with VALID at zero. Returns the number of such arms.

    Writes: BELOW.
    """
    invalid = 0
    n = state.shape[2]
    ws, shared = workspace(n)
    tip = U((n - 1) * STRIDE)
    for start in range(first, end, W):
        gather(ws, n, start, state[:end], parameters, voltage)
        for k in range(LANES):
            shared[BELOW + k] = 0.0
        evaluate(ws, shared, n, elbows)
        for _ in range(n_steps):
            rk4_step(ws, shared, n, tip, elbows, step)
        for lane in range(min(W, end - start)):
            if not scatter(ws, shared, n, lane, elbows, state[start + lane], summary[start + lane]):
                invalid += 1
    return invalid


@template(entry=True)
def accelerations(state, parameters, voltage, elbows, q_ddot, current_dot, elbow_force):
    """Right-hand side of eq. 17 at each arm's state: q_ddot and current_dot (B, n), elbow_force (B, p).

    Reads: Q_DOT_SUM, CURRENT_SUM, FORCES.
    """
    n = state.shape[2]
    ws, shared = workspace(n)
    for start in range(0, state.shape[0], W):
        gather(ws, n, start, state, parameters, voltage)
        evaluate(ws, shared, n, elbows)
        # The increments of a step of one second are the rates.
        first_stage(ws, n, 1.0, 0.0)
        for lane in range(min(W, state.shape[0] - start)):
            for a in range(n):
                q_ddot[start + lane, a] = ws[U(a * STRIDE + lane) + Q_DOT_SUM]
                current_dot[start + lane, a] = ws[U(a * STRIDE + lane) + CURRENT_SUM]
            for j in range(elbows.size):
                elbow_force[start + lane, j] = shared[FORCES + U(j * W + lane)]


@template(entry=True)
def project_poses(q, parameters, elbows):
    """Moves poses q (B, n) onto the elbows' plane in place, as far as Newton's method gets.

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

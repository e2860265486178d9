"""Runs of arms under constant voltages, and control periods from actions to observations and rewards."""

# pyright: basic

import numpy as np

from elbow_gym.kernel.acceleration import accelerate
from elbow_gym.kernel.block import gather, scatter, workspace
from elbow_gym.kernel.integration import move
from elbow_gym.kernel.observe import observe
from elbow_gym.kernel.slots import BELOW, LANES, W
from elbow_gym.kernel.template import template


@template(flat=True)
def run(state, parameters, voltage, elbows, steps, summary, first, end):
    """Arms first..end-1 through steps of given lengths; returns the number of those that are not VALID.

    Writes: BELOW.
    """
    invalid = 0
    n = state.shape[2]
    ws, shared = workspace(n)
    for start in range(first, end, W):
        gather(ws, n, start, state[:end], parameters, voltage)
        for k in range(LANES):
            shared[BELOW + k] = 0.0
        move(ws, shared, n, elbows, steps)
        accelerate(ws, n, 0.0)
        for lane in range(min(W, end - start)):
            if not scatter(ws, shared, n, lane, elbows, state[start + lane], summary[start + lane]):
                invalid += 1
    return invalid


@template(entry=True)
def advance(state, parameters, voltage, elbows, steps, summary, first, end):
    """Advances arms first..end-1 of a batch under constant voltage, in place.

    An arm whose state leaves the representable keeps its old state and summary, with VALID at zero.

    Args:
        state: state rows, (B, STATE_ROWS, n).
        parameters: parameter rows, (B, PARAMETER_ROWS, n).
        voltage: terminal voltages [V], (B, n).
        elbows: joint numbers of the elbows, (p,).
        steps: lengths of the steps [s].
        summary: filled, (B, SUMMARY_COLUMNS + p).
        first: first arm.
        end: arm after the last.

    Returns:
        The number of arms that are not VALID.
    """
    return run(state, parameters, voltage, elbows, steps, summary, first, end)


@template(entry=True)
def control_step(
    action, voltage, highest, volts, queue, late, state, parameters, elbows, steps, summary, pose, coefficients, phase,
    turn, periods, lookahead, starts, scale, high, price, spent, observation, figures, first, end,
):  # fmt: skip
    """One control period of arms first..end-1: volts of actions, steps, observation and reward.

    State to summary are those of `advance`, pose to figures those of `observe`.

    Args:
        action: actions (B, n), in their unit.
        voltage: filled with the voltages that arrive at the motors [V], (B, n).
        highest: largest action of each arm, (B,).
        volts: volts per unit of action, (B,).
        queue: voltages asked for, newest first [V], (B, 1 + longest delay, n).
        late: delay of each arm's actions [control periods], (B,).

    Returns:
        The number of arms that are not VALID; -1, with nothing changed, where an action is not a number.
    """
    for b in range(first, end):
        for a in range(action.shape[1]):
            if np.isnan(action[b, a]):
                return -1
    for b in range(first, end):
        for d in range(queue.shape[1] - 1, 0, -1):
            for a in range(action.shape[1]):
                queue[b, d, a] = queue[b, d - 1, a]
        for a in range(action.shape[1]):
            queue[b, 0, a] = min(max(action[b, a], -highest[b]), highest[b]) * volts[b]
        for a in range(action.shape[1]):
            voltage[b, a] = queue[b, late[b], a]
    invalid = run(state, parameters, voltage, elbows, steps, summary, first, end)
    observe(
        state, summary, pose, coefficients, phase, turn, periods, lookahead, starts, scale, high, price, spent,
        observation, figures, first, end,
    )  # fmt: skip
    return invalid

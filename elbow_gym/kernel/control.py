"""Runs of arms under constant voltages, and control periods from actions to observations and rewards."""

# pyright: basic

import numpy as np

from elbow_gym.kernel.acceleration import accelerate
from elbow_gym.kernel.block import gather, scatter, workspace
from elbow_gym.kernel.integration import move
from elbow_gym.kernel.observe import observe
from elbow_gym.kernel.rows import DELAY, HIGHEST, PERIODS, TASK_COLUMNS, VOLTS
from elbow_gym.kernel.slots import ASTRAY, BELOW, LANES, W
from elbow_gym.kernel.template import template


@template(flat=True)
def run(state, parameters, voltage, elbows, steps, summary, first, end):
    """Arms first..end-1 through steps of given lengths; returns the number of those that are not VALID.

    Writes: ASTRAY, BELOW.
    """
    invalid = 0
    n = state.shape[2]
    ws, shared = workspace(n)
    for start in range(first, end, W):
        gather(ws, n, start, state[:end], parameters, voltage)
        for k in range(LANES):
            shared[BELOW + k] = 0.0
            shared[ASTRAY + k] = 0.0
        move(ws, shared, n, elbows, steps)
        accelerate(ws, n, 0.0)
        for lane in range(min(W, end - start)):
            if not scatter(ws, shared, n, lane, elbows, state[start + lane], summary[start + lane]):
                invalid += 1
    return invalid


@template(entry=True)
def control_step(
    action, voltage, queue, state, parameters, elbows, steps, summary, clock, task, path, pose, starts, scales, price,
    observation, figures, first, end,
):  # fmt: skip
    """One control period of arms first..end-1: volts of actions, steps, observation and reward.

    Without steps, the summary is that of the present state, and without rows of voltages it stays. An arm whose state
    leaves the representable keeps its old state and summary, with VALID at zero. From clock on, arguments are those of
    `observe`.

    Args:
        action: actions (B, n), in their unit.
        voltage: filled with the voltages that arrive at the motors [V], (B, n).
        queue: voltages asked for, newest first [V], (B, 1 + longest delay, n); without rows, voltages are given as they
            are, and actions are not read.
        state: state rows, (B, STATE_ROWS, n).
        parameters: parameter rows, (B, PARAMETER_ROWS, n).
        elbows: joint numbers of the elbows, (p,).
        steps: lengths of the steps [s].
        summary: filled, (B, SUMMARY_COLUMNS + p).
        clock: moved on by a control period, (B, 2), where actions are read.
        task: also the largest actions, the volts per unit of action and the delays.
        observation: filled, unless it has no columns.

    Returns:
        The number of arms that are not VALID; -1, with nothing changed, where an action is not a number.
    """
    n = state.shape[2]
    if queue.shape[1] > 0:
        for b in range(first, end):
            for a in range(n):
                if np.isnan(action[b, a]):
                    return -1
        for b in range(first, end):
            highest = task[b, HIGHEST]
            for a in range(n):
                for d in range(queue.shape[1] - 1, 0, -1):
                    queue[b, d, a] = queue[b, d - 1, a]
                queue[b, 0, a] = min(max(action[b, a], -highest), highest) * task[b, VOLTS]
                voltage[b, a] = queue[b, int(task[b, DELAY]), a]
            clock[b, PERIODS] += 1
    invalid = 0
    if voltage.shape[0] > 0:
        invalid = run(state, parameters, voltage, elbows, steps, summary, first, end)
    if observation.shape[1] > 0:
        observe(
            state, summary, clock, task, path, pose, starts, scales, price, observation, figures, first, end
        )  # fmt: skip
    return invalid


NO_QUEUE, NO_VOLTAGE = np.zeros((0, 0, 0)), np.zeros((0, 0))
NO_PARAMETERS, NO_ELBOWS, NO_STEPS = np.zeros((0, 0, 0)), np.zeros(0, np.int64), np.zeros(0)
# Clock to figures of a call that only moves the arms.
NO_TASK = (
    np.zeros((0, 2), np.int64), np.zeros((0, TASK_COLUMNS)), np.zeros((0, 0, 3)), np.zeros(0), np.zeros(0, np.int64),
    np.zeros((2, 0)), np.zeros(4), np.zeros((0, 0), np.float32), np.zeros((0, 0)),
)  # fmt: skip

"""Calls of the kernel's entries, compiled or not, with plain arrays, batch axis first."""

from functools import cache

import numpy as np

from elbow_gym import paper_arm
from elbow_gym.kernel.build import assemble, kernel
from elbow_gym.kernel.rows import PARAMETER_ROWS, STATE_ROWS, SUMMARY_COLUMNS
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_table

ELBOWS = (4, 7)
EVERYTHING = {"table": True, "rubbing": True, "drive": True}


@cache
def uncompiled(lanes, **switches):
    """The kernel's entries as plain Python: a millisecond for a step of one arm, and nothing to compile."""
    off = dict.fromkeys(EVERYTHING, False)
    return assemble(lanes, lambda function, **_: function, **({**off, "exponential": True} | switches))


def shared(lanes, exponential=True, **switches):
    """The plain kernel, or for any switches the one with all of them: the same bits, and two to compile of eight.

    Of the classical method the plain Python of its own, which suits a few hundred steps.
    """
    if not exponential:
        return uncompiled(lanes, exponential=False, **switches)
    return kernel(lanes, **(EVERYTHING if any(switches.values()) else {}))


def states(q, q_dot, current):
    """Kernel state rows (B, STATE_ROWS, n) with empty meters."""
    state = np.zeros((len(q), STATE_ROWS, q.shape[1]))
    state[:, 0], state[:, 1], state[:, 2] = q, q_dot, current
    return state


def accelerations(lanes, state, parameters, voltage, elbows, make=kernel, **switches):
    """The kernel's q_ddot, elbow forces and current rates of a batch; `make` is what gives the kernel's entries."""
    q_ddot, current_dot, force = np.zeros_like(voltage), np.zeros_like(voltage), np.zeros((len(voltage), len(elbows)))
    joints = np.array(elbows, dtype=np.int64)
    make(lanes, **switches).accelerations(state, parameters, voltage, joints, q_ddot, current_dot, force)
    return q_ddot, force, current_dot


def accelerations_of(case, payload=0.0):
    """The kernel's accelerations, elbow forces and current rates of one arm."""
    state = states(case.q[None], case.q_dot[None], case.current[None])
    table = parameter_table(case.arm, Conditions(payload=payload))[None]
    return [value[0] for value in accelerations(1, state, table, case.voltage[None], case.elbows)]


def batch(size):
    """Arms that differ in state, voltage and every parameter, near the start pose."""
    rng = np.random.default_rng(5)
    scatter = rng.uniform(0.7, 1.4, (40, PARAMETER_ROWS, 10))
    parameters = parameter_table(paper_arm(), Conditions(payload=0.2)) * scatter
    state = states(paper_arm().nominal_pose + 0.3 * rng.normal(size=(40, 10)), *rng.normal(size=(2, 40, 10)))
    return state[:size].copy(), parameters[:size].copy(), rng.uniform(-24.0, 24.0, (40, 10))[:size].copy()


def advanced(lanes, size, n_steps=20, elbows=ELBOWS):
    """State and summary of a batch after some steps of 1 ms."""
    state, parameters, voltage = batch(size)
    summary = np.zeros((size, SUMMARY_COLUMNS + len(elbows)))
    joints = np.array(elbows, dtype=np.int64)
    kernel(lanes).advance(state, parameters, voltage, joints, np.full(n_steps, 0.001), summary, 0, size)
    return np.concatenate([state.reshape(size, -1), summary], axis=1)

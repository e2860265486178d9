"""Made-up recordings, for tests of what is computed from them."""

import numpy as np

from agents.evaluation.recording import Recording
from elbow_gym.task.circle import Circle


def made_up(settings, time, joints=10, **series):
    """A run of one arm of `joints` joints: zeros but for the series given, each with the axes (time, arm, ...)."""
    zeros, points = np.zeros((len(time), 1, joints)), np.zeros((len(time), 1, 3))
    names = ("q", "q_dot", "electrical_energy", "drawn_energy", "copper_loss", "link_work", "voltage", "current")
    blank = dict.fromkeys(names, zeros) | {
        "hand": points,
        "target": points,
        "elbow_force": np.zeros((len(time), 1, len(settings.elbow_joints))),
        "below_table": np.zeros((len(time), 1)),
    }
    return Recording(settings, (0,), time, **(blank | series))


def papers_target(time):
    """The paper's circle at the given times [m], (time, 1, 3)."""
    return Circle().position(Circle().angle(time, 0.0))[:, None]

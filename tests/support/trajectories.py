"""Trajectories that several tests follow."""

import numpy as np

from agents.control.trajectory import Trajectory


def resting(arm, periods=5):
    """The start pose at rest, without voltages."""
    q, zero = np.tile(arm.nominal_pose, (periods + 1, 1)), np.zeros((periods + 1, arm.n_joints))
    return Trajectory(q, zero, zero, zero[1:])

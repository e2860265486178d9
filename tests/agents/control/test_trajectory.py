"""A trajectory survives its file, and open loop its voltages are played as they are."""

import numpy as np

from agents.control.trajectory import OpenLoop, Trajectory
from agents.optimal.guesses import rollout
from elbow_gym.task.settings import Settings
from tests.support.trajectories import resting


def test_trajectory_survives_its_file(arm, tmp_path):
    trajectory = resting(arm)
    trajectory.save(tmp_path / "t.npz")
    for name, array in vars(Trajectory.load(tmp_path / "t.npz")).items():
        np.testing.assert_array_equal(array, getattr(trajectory, name))


def test_open_loop_plays_the_voltages_period_by_period(arm):
    trajectory = resting(arm)
    trajectory.voltage[:] = np.arange(50.0).reshape(5, 10) / 10.0
    _, recording = rollout(Settings(duration=0.1), lambda env: OpenLoop(env, trajectory))
    np.testing.assert_allclose(recording.voltage[1:, 0], trajectory.voltage, rtol=1e-6)

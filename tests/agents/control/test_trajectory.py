"""A trajectory survives its file, and open loop its voltages are played as they are."""

from dataclasses import replace

import numpy as np
import pytest

from agents.control.trajectory import OpenLoop, Trajectory
from agents.optimal.guesses import rollout
from elbow_gym.task.settings import Settings
from tests.support.trajectories import resting


def test_trajectory_survives_its_file(arm, tmp_path):
    trajectory = resting(arm)
    trajectory.save(tmp_path / "t.npz")
    for name, array in vars(Trajectory.load(tmp_path / "t.npz")).items():
        np.testing.assert_array_equal(array, getattr(trajectory, name))


def test_trajectory_that_is_cut_flipped_or_not_finite_is_refused_by_name(arm, tmp_path):
    trajectory, path = resting(arm), tmp_path / "t.npz"
    trajectory.save(path)
    whole, rng = path.read_bytes(), np.random.default_rng(0)
    refused = 0
    for place in rng.integers(len(whole), size=60):
        path.write_bytes(whole[:place])
        with pytest.raises(ValueError, match=r"t\.npz must be an \.npz file as it was written, got a damaged one"):
            Trajectory.load(path)
        flipped = bytearray(whole)
        flipped[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        try:
            loaded = Trajectory.load(path)
        except ValueError:
            refused += 1
        else:
            # Some bits of a zip, such as a file's date, decide nothing.
            for name, array in vars(loaded).items():
                np.testing.assert_array_equal(array, getattr(trajectory, name))
    assert refused > 20
    current = trajectory.current.copy()
    current[2, 3] = np.nan
    replace(trajectory, current=current).save(path)
    with pytest.raises(ValueError, match=r"current in .*t\.npz must be finite, got nan"):
        Trajectory.load(path)
    Trajectory(trajectory.q, trajectory.q_dot, trajectory.q[:-1], trajectory.voltage).save(path)
    with pytest.raises(
        ValueError, match=r"current in .*t\.npz must be numbers of shape \(6, 10\), got float64 \(5, 10\)"
    ):
        Trajectory.load(path)
    np.savez(path, q=trajectory.q)
    with pytest.raises(ValueError, match=r"t\.npz must hold the arrays \['q', 'q_dot', .*got \['q'\]"):
        Trajectory.load(path)


def test_open_loop_plays_the_voltages_period_by_period(arm):
    trajectory = resting(arm)
    trajectory.voltage[:] = np.arange(50.0).reshape(5, 10) / 10.0
    _, recording = rollout(Settings(duration=0.1), lambda env: OpenLoop(env, trajectory))
    np.testing.assert_allclose(recording.voltage[1:, 0], trajectory.voltage, rtol=1e-6)

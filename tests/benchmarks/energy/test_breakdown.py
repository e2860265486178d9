"""Shares of the PD's energy: each is what it is called, and they sum to the whole."""

from functools import partial

import numpy as np
import pytest

from agents.control import classical
from agents.control.posture import best_postures, static_copper_loss
from benchmarks.energy import breakdown
from elbow_gym.task.settings import Settings


def test_parts_sum_to_the_whole_joint_by_joint_and_each_is_what_it_is_called(arm, monkeypatch):
    # One search for the least posture is enough.
    monkeypatch.setattr(classical, "best_postures", partial(best_postures, starts=1))
    joints = {"A": np.arange(10.0), "C": np.linspace(3.0, 5.0, 10)}
    (share,) = breakdown.breakdown(lambda elbows, regime: joints[regime], [2])
    np.testing.assert_allclose(share.start_step + share.sag + share.posture + share.least, joints["A"], atol=1e-9)
    papers = breakdown.exact_energy(Settings(elbows=2), arm.nominal_pose)
    np.testing.assert_allclose(share.start_step, joints["A"] - joints["C"])
    np.testing.assert_allclose(share.sag, joints["C"] - papers)
    assert 0.0 < share.least.sum() < 0.5 * papers.sum()


@pytest.mark.parametrize("elbows", [0, 1, 2])
def test_exact_motion_on_a_slow_circle_costs_the_static_copper_loss(arm, elbows):
    circle = {"radius": 1e-3, "period": 1000.0}
    settings = Settings(elbows=elbows, circle=circle)
    q = breakdown.inverse_kinematics(arm, arm.nominal_pose, settings.parsed_circle.position(0.0))[0]
    expected = static_copper_loss(arm, settings.elbow_joints, q) * settings.duration
    assert breakdown.exact_energy(settings, arm.nominal_pose).sum() == pytest.approx(expected, rel=1e-3)

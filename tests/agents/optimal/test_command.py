"""`python -m agents bound`: what its options mean and what it prints."""

import numpy as np
import pytest

from agents import optimal
from agents.control.trajectory import Trajectory
from agents.optimal import command
from agents.optimal.command import settings_of, solve_and_print
from agents.optimal.store import Store
from elbow_gym import paper_arm


def test_elbows_are_a_count_or_joint_numbers():
    assert [settings_of(elbows, (1.0, 0.001), None, {}).elbow_joints for elbows in ((2,), (0,), (4,), (4, 6))] == [
        (4, 7),
        (),
        (4,),
        (4, 6),
    ]


def test_weights_pose_and_other_arguments_reach_the_settings():
    pose = [0.1, *paper_arm().nominal_pose[1:]]
    settings = settings_of((0,), (2.0, 0.01), pose, {"payload": 0.2, "voltage_limit": 12.0})
    assert (settings.tracking_weight, settings.energy_weight) == (2.0, 0.01)
    assert settings.parsed_arm.nominal_pose == tuple(pose)
    assert (settings.payload, settings.voltage_limit, settings.start_noise) == (0.2, 12.0, 0.0)


@pytest.mark.slow
def test_command_prints_the_certificate_and_writes_the_trajectory(tmp_path, monkeypatch, capsys):
    pytest.importorskip("casadi")
    found = []

    def here(settings, **options):
        found.append(optimal.bound(settings, **{**options, "parallel": False, "store": Store(tmp_path)}))
        return found[0]

    monkeypatch.setattr(command, "bound", here)
    output = tmp_path / "optimum.npz"
    settings = settings_of((2,), (1.0, 0.001), None, {"duration": 0.1, "start": "on_target"})
    solve_and_print(settings, above_table=None, fresh=False, output=output)
    said = capsys.readouterr().out
    assert f"return                {-found[0].cost:.6g}" in said
    assert f"mesh change           {found[0].certificate.mesh_change:.2g}" in said
    np.testing.assert_array_equal(Trajectory.load(output).voltage, found[0].optimum.trajectory.voltage)

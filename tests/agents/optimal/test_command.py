"""`python -m agents bound`: what its options mean and what it prints."""

import numpy as np
import pytest

from agents import optimal
from agents.control.trajectory import Trajectory
from agents.jobs.machines import Machines
from agents.optimal import command
from agents.optimal.command import settings_of, solve_and_print, solve_file
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
        found.append(optimal.bound(settings, **{**options, "machines": None, "store": Store(tmp_path)}))
        return found[0]

    monkeypatch.setattr(command, "bound", here)
    monkeypatch.setattr("agents.optimal.guesses.SEARCHES", 2)
    output = tmp_path / "optimum.npz"
    settings = settings_of((2,), (1.0, 0.001), None, {"duration": 0.1, "start": "on_target"})
    solve_and_print(settings, above_table=None, fresh=False, output=output)
    said = capsys.readouterr().out
    assert f"return                {-found[0].cost:.6g}" in said
    assert f"mesh change           {found[0].certificate.mesh_change:.2g}" in said
    np.testing.assert_array_equal(Trajectory.load(output).voltage, found[0].optimum.trajectory.voltage)


def test_tasks_of_a_file_become_rows_and_those_that_fail_are_named(tmp_path, monkeypatch, capsys):
    given = []

    def here(settings, **options):
        given.extend(settings)
        assert options["starts"] == 3
        options["progress"](0)
        return ["no guess converged"] * len(settings)

    monkeypatch.setattr(command, "bounds", here)
    tasks, output = tmp_path / "tasks.json", tmp_path / "bounds.csv"
    tasks.write_text('[{"elbows": 1, "payload": 0.2}, {"elbows": 0}]')
    solve_file(tasks, output, None, Machines(), starts=3)
    assert [(one.elbow_joints, one.payload, one.start_noise) for one in given] == [((4,), 0.2, 0.0), ((), 0.0, 0.0)]
    assert output.read_text().splitlines() == ["task,status", "0,no guess converged", "1,no guess converged"]
    assert "task 1 failed: no guess converged\n0 of 2 tasks solved" in capsys.readouterr().out


@pytest.mark.parametrize("text", ['{"elbows": 1}', "[1]", "["])
def test_a_file_of_something_else_is_refused_before_anything_is_solved(tmp_path, text):
    tasks = tmp_path / "tasks.json"
    tasks.write_text(text)
    with pytest.raises(ValueError, match=r"tasks\.json must hold"):
        solve_file(tasks, tmp_path / "bounds.csv", None, Machines())
    tasks.write_text('[{"elbow": 1}]')
    with pytest.raises(ValueError, match=r"task 0 of .*tasks\.json: .*elbow"):
        solve_file(tasks, tmp_path / "bounds.csv", None, Machines())

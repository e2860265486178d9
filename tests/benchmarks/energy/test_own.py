"""A user's own players and arm in the benchmark: rows, labels, figures, and what is refused before anything plays."""

import csv

import numpy as np
import pytest

import benchmarks
from agents.evaluation.guest import Guest
from agents.evaluation.players import CLASSICAL
from agents.task_options import TaskOptions
from benchmarks.energy import run
from benchmarks.energy.cells import Cell, featured, guest_cells, own_arm_cells, players
from benchmarks.energy.own import measure_own
from benchmarks.energy.run import Plan, bound, energy, play, stored
from elbow_gym.interface import Interface
from elbow_gym.kinematics import HandPlacement
from tests.support.arms import six_joint_arm


class Follower:
    """PD of a user's own."""

    environment = {"control_frequency": 500.0}

    def __init__(self, env):
        self.own = Interface(env)
        self.placement = HandPlacement(self.own.arm, self.own.pose)

    def predict(self, observation):
        seen = self.own.decode(observation)
        q_d, q_d_dot = self.placement.joints(*self.own.target(self.own.target_angle(seen)))
        return self.own.action(200.0 * (q_d - self.own.joint_angles(seen)) + 5.0 * (q_d_dot - seen["joint_velocity"]))


def rows(path):
    with path.open(encoding="utf-8") as handle:
        return list(csv.DictReader(handle))


@pytest.mark.slow
def test_own_player_is_a_row_beside_the_others_under_its_label(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(run, "cells", lambda parts: [Cell("ppo", 2), Cell("ppo", 1)])
    guests = [Guest("my PD", Follower)]
    options = {"folder": tmp_path / "cache", "parallel": False}
    own = energy(tmp_path / "out", episodes=1, **options, guests=guests, elbows=2)
    assert [(row.controller, row.elbows) for row in own] == [("ppo", 2)] * 3 + [("my PD", 2)] * 3
    assert own[3].gap > 1.0
    assert [row["controller"] for row in rows(tmp_path / "out" / "energy.csv")] == ["ppo"] * 3 + ["my PD"] * 3
    assert float(rows(tmp_path / "out" / "energy.csv")[3]["voltage_change [V]"]) > 0.0
    efforts = rows(tmp_path / "out" / "effort.csv")
    assert [row["controller"] for row in efforts] == ["ppo", "my PD"]
    assert all(float(row["decision [ms]"]) > 0.0 and row["processor"] for row in efforts)
    assert "my PD" in (tmp_path / "out" / "energy.md").read_text()
    assert "  my PD " in capsys.readouterr().out
    assert featured("my PD")
    assert not featured("clone")


def test_what_python_makes_is_never_taken_over_from_an_earlier_run(tmp_path):
    cell = Cell("mine", 2, guest=Guest("mine", Still))
    chosen = Plan([cell], [20_000], every_seed=False, folder=tmp_path)
    play(cell, chosen, lambda _: None)
    assert stored(cell, chosen) is None
    assert not list(tmp_path.iterdir())


class Still:
    environment = {"duration": 2.1}

    def __init__(self, env):
        self.num_envs = env.num_envs

    def predict(self, observation):
        return np.zeros((self.num_envs, 10))


def test_guest_plays_at_the_elbow_counts_that_it_can():
    assert [cell.elbows for cell in guest_cells([Guest("mine", Still)], (2, 1, 0))] == [2, 1, 0]
    from elbow_gym.baselines.policy import baseline_path

    policy = Guest.named(f"mine={baseline_path('ppo_elbows1')}")
    assert [cell.elbows for cell in guest_cells([policy], (2, 1, 0))] == [1]
    with pytest.raises(ValueError, match=r"^elbows must be 1 as in the policy's training, got 2"):
        guest_cells([policy], (2,))


def test_labels_differ_and_are_not_the_registrys():
    with pytest.raises(ValueError, match=r"^labels of players of your own must differ, got \['a', 'a'\]"):
        guest_cells([Guest("a", Still), Guest("a", Follower)], (2,))
    with pytest.raises(ValueError, match=r"^label of a player of your own must not be one of the registry, got pd"):
        Guest("pd", Still)


def test_bound_counts_for_an_own_player_of_the_same_task_only():
    assert bound(Cell("mine", 2, guest=Guest("mine", Follower)), "A") == bound(Cell("pd", 2), "A") is not None
    assert bound(Cell("mine", 2, guest=Guest("mine", Still)), "A") is None
    assert bound(Cell("mine", 2, guest=Guest("mine", Follower)), "B") is None


def test_own_arm_is_played_by_the_classical_controllers_and_guests():
    cells = own_arm_cells({"arm": six_joint_arm(), "elbows": (4,)}, [Guest("mine", Follower)])
    assert [cell.controller for cell in cells] == [name for name in CLASSICAL if name != "pd_paper"] + ["mine"]
    for cell in cells:
        [player] = players(cell)
        assert player.settings.parsed_arm == six_joint_arm()
        assert player.settings.elbow_joints == (4,)
        assert bound(cell, "A") is None
    assert players(cells[0])[0].settings.control_frequency == 2000.0
    assert players(cells[-1])[0].settings.control_frequency == 500.0


def test_results_with_own_players_are_not_published():
    with pytest.raises(ValueError, match=r"^--publish must be given without --with, --elbows, --arm and --environment"):
        energy(publish=True, guests=[Guest("mine", Still)])


def test_joints_need_an_own_arm():
    with pytest.raises(ValueError, match=r"^--elbows must be 0, 1 or 2 without --arm or --environment, got \(4, 7\)"):
        measure_own(TaskOptions(elbows=(4, 7)), [], trust=False)


def test_score_gives_a_small_table_from_python():
    scores = benchmarks.score(Still, beside=["clone"], episodes=1, label="still")
    assert {row.controller for row in scores.rows} == {"still", "clone"}
    lines = str(scores).splitlines()
    assert len(lines) == 4
    assert [line.split()[0] for line in lines[2:]] == ["clone", "still"]
    with pytest.raises(ValueError, match=r"^beside must hold names of .* got 'nobody'"):
        benchmarks.score(Still, beside=["nobody"])


def test_planners_play_where_they_are_named(monkeypatch):
    found = {}
    monkeypatch.setattr(run, "measure", lambda chosen, *_: found.update(cells=chosen.cells) or [])
    monkeypatch.setattr(run, "cells", lambda parts: [Cell("ppo", 2), Cell("ppo", 1)])
    for name in ("save", "check_writable"):
        monkeypatch.setattr(run, name, lambda *_: None)
    monkeypatch.setattr(run.effort, "save", lambda *_: None)
    monkeypatch.setattr(run.terminal, "report", lambda *_: "")
    measure_own(TaskOptions(elbows=2), ["sampling_mpc", "mine=pd"], trust=False)
    assert [(cell.controller, cell.elbows) for cell in found["cells"]] == [("ppo", 2), ("sampling_mpc", 2), ("mine", 2)]
    assert featured("sampling_mpc")
    with pytest.raises(ValueError, match=r"^--publish must be given without --with"):
        measure_own(TaskOptions(elbows=None), ["sampling_mpc"], trust=False, publish=True)
    cells = own_arm_cells({"arm": six_joint_arm(), "elbows": (4,)}, planners=["receding_horizon"])
    assert cells[-1].controller == "receding_horizon"
    assert players(cells[-1])[0].settings.parsed_arm == six_joint_arm()

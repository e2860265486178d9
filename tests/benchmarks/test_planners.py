"""Planners' table: rows that are the players' own on the nominal and the first evaluation tasks, and means."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.metrics import metrics
from agents.evaluation.player import player_of
from agents.evaluation.players import find_player
from agents.evaluation.recording import record
from benchmarks import planners as module
from benchmarks.planners import FIGURES, HEADER, NOMINAL, Task, planners, table
from benchmarks.tasks import episodes
from benchmarks.tasks.optima import optimal_figures
from benchmarks.tasks.task_set import EVALUATION
from elbow_gym.suite import ENV
from elbow_gym.task.settings import Settings


class Still:
    """Controller without voltage, with a count of failures."""

    failures = 3

    def __init__(self, env):
        self.num_envs = env.num_envs

    def predict(self, observation, **_):
        return np.zeros((self.num_envs, 10), np.float32), None


def test_figures_of_the_nominal_task_are_the_players_own_episode():
    player = player_of("still", replace(find_player("ppo", 2).settings, duration=2.1), Still)
    found = Task(2).play(player)
    expected = metrics(record(replace(player.settings, start_noise=0.0), Still, [0]))
    assert found["return [-]"] == expected["return"][0]
    assert found["energy [J]"] == expected["electrical_energy"][0]
    assert found["decision [ms]"] > 0.0
    assert found["failures [-]"] == 3.0


def test_policy_of_drawn_tasks_plays_the_nominal_circle_too():
    player = find_player("newton_tasks", 2, ENV)
    assert Task(2).play(player)["return [-]"] > 1.05 * -Task(2).bound()


def test_figures_of_an_evaluation_task_are_those_of_its_comparison():
    player = player_of("still", Settings(duration=2.1), Still)
    found = Task(2, 3).play(player)
    expected = episodes.play(player, 3, EVALUATION.numbered(2)[3], episodes.DISTURBANCES[episodes.NOMINAL])
    assert (found["return [-]"], found["energy [J]"]) == (-expected["cost"], expected["energy"])
    assert found["decision [ms]"] > 0.0


def test_task_that_a_controller_refuses_has_the_worst_figures(tmp_path, monkeypatch):
    def refuse(env):
        raise ValueError("position must be within reach")

    player = replace(player_of("still", Settings(duration=2.1), refuse), identity="still")
    monkeypatch.setattr(module, "_player", lambda name, elbows: player)
    found = module._played(Task(2, 3), "still", tmp_path, lambda _: None)
    assert found["return [-]"] < -100.0
    assert found["decision [ms]"] == 0.0
    # What is stored is taken over: it must be finite.
    monkeypatch.setattr(Task, "play", None)
    assert module._played(Task(2, 3), "still", tmp_path, lambda _: None) == found


def test_bounds_are_the_shipped_optima():
    assert Task(2).bound() == pytest.approx(30.1, abs=0.1)
    assert Task(2, 3).bound() == optimal_figures()[2, 3]["cost"]
    assert Task(2, 1000).bound() is None


def test_planners_table_is_made_of_its_rows_and_episodes_are_played_once(tmp_path, monkeypatch):
    pytest.importorskip("casadi")
    counted = []
    monkeypatch.setattr(module, "PLAYERS", ("ppo",))
    monkeypatch.setattr(module, "ELBOW_COUNTS", (2,))
    monkeypatch.setattr(module, "do_all", lambda jobs, tell, _: {key: job.work(tell) for key, job in jobs.items()})

    def played(task, player):
        counted.append(task.name)
        return dict.fromkeys(FIGURES, 1.5)

    monkeypatch.setattr(Task, "play", played)
    for _ in range(2):
        text = planners(tmp_path / "out", 2, (2,), folder=tmp_path / "cache")
    assert counted == [NOMINAL, "0", "1"]
    assert (tmp_path / "out" / "planners.md").read_text() == text
    rows = (tmp_path / "out" / "planners.csv").read_text().splitlines()
    assert rows[0].split(",") == list(HEADER)
    assert rows[1].startswith("nominal,2,ppo,1.5,1.5,1.5,1.5,1.5,-30")
    assert [row.split(",")[0] for row in rows[1:]] == [NOMINAL, "0", "1"]


def test_table_has_nominal_rows_and_means_of_the_drawn_ones():
    def row(task, name, value, bound):
        return [task, 2, name, f"{value}", "100", "1", "5", "", bound]

    found = [row(NOMINAL, "ppo", -32.0, "-30"), row("0", "ppo", -10.0, "-9"), row("1", "ppo", -20.0, "")]
    lines = table(found).splitlines()[2:]
    assert lines[0] == "| nominal, elbows 2 | PPO, 24 V | -32.00 | -30.00 | 100 | 1.00 | 5.00 |"
    # A mean over some of the bounds would be of other tasks than the return's.
    assert lines[1] == "| mean of 2 drawn, elbows 2 | PPO, 24 V | -15.00 |  | 100 | 1.00 | 5.00 |"

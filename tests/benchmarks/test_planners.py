"""Planners' table: tasks drawn in a fixed order, rows that are the players' own, and means."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.metrics import metrics
from agents.evaluation.player import player_of
from agents.evaluation.players import find_player
from agents.evaluation.recording import record
from benchmarks import planners as module
from benchmarks.planners import FIGURES, HEADER, NOMINAL, Task, drawn_tasks, planners, play, playable, table
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv


def test_more_tasks_are_the_same_tasks_and_some_others_at_every_elbow_count():
    few, many = drawn_tasks(3, 2), drawn_tasks(6, 0)
    assert [task.arguments for task in few] == [task.arguments for task in many[:3]]
    assert {task.elbows for task in few} == {2}
    for task in many:
        circle = Settings(elbows=0, **task.arguments).parsed_circle
        assert np.abs(np.array(circle.center) - (1.5, 1.5, 0.4)).max() <= 0.15
        assert 0.0 <= task.arguments["payload"] <= 0.3
        assert task.arguments["start_noise"] == 0.0


def test_tasks_without_a_start_pose_are_passed_over():
    far = Task("far", 2, {"circle": {"center": [1.5, 1.5, 0.75], "radius": 0.1}, "start": "on_target"})
    with pytest.raises(ValueError, match="position must be within reach"):
        ElbowArmVectorEnv(1, elbows=2, **far.arguments).reset(seed=0)
    near = Task("near", 2, {})
    assert playable([far, near, near], 1) == [near]


class Still:
    """Controller without voltage, with a count of failures."""

    failures = 3

    def __init__(self, env):
        self.num_envs = env.num_envs

    def predict(self, observation, **_):
        return np.zeros((self.num_envs, 10), np.float32), None


def test_figures_are_the_players_own_episode():
    player = player_of("still", find_player("ppo", 2).settings, Still)
    found = play(Task(NOMINAL, 2, {"start_noise": 0.0, "duration": 2.1}), player)
    expected = metrics(record(replace(player.settings, start_noise=0.0, duration=2.1), Still, [0]))
    assert found["return [-]"] == expected["return"][0]
    assert found["energy [J]"] == expected["electrical_energy"][0]
    assert found["decision [ms]"] > 0.0
    assert found["failures [-]"] == 3.0


def test_bound_of_the_nominal_task_is_the_shipped_optimums():
    assert Task(NOMINAL, 2, {}).bound() == pytest.approx(30.1, abs=0.1)


def test_planners_table_is_made_of_its_rows_and_episodes_are_played_once(tmp_path, monkeypatch):
    pytest.importorskip("casadi")
    counted = []
    monkeypatch.setattr(module, "PLAYERS", ("ppo",))
    monkeypatch.setattr(module, "ELBOW_COUNTS", (2,))
    monkeypatch.setattr(module, "do_all", lambda jobs, tell: {key: job.work(tell) for key, job in jobs.items()})

    def played(task, player):
        counted.append(task.name)
        if task.name == "1":
            raise ValueError("position must be within reach")
        return dict.fromkeys(FIGURES, 1.5)

    monkeypatch.setattr(module, "play", played)
    for _ in range(2):
        text = planners(tmp_path / "out", 2, (2,), folder=tmp_path / "cache")
    assert counted == [NOMINAL, "0", "1", "1"]
    assert (tmp_path / "out" / "planners.md").read_text() == text
    rows = (tmp_path / "out" / "planners.csv").read_text().splitlines()
    assert rows[0].split(",") == list(HEADER)
    assert rows[1].startswith("nominal,2,ppo,1.5,1.5,1.5,1.5,1.5,-30")
    # A controller that refuses a task has no row there.
    assert [row.split(",")[0] for row in rows[1:]] == [NOMINAL, "0"]


def test_table_has_nominal_rows_and_means_of_the_drawn_ones():
    def row(task, name, value, bound):
        return [task, 2, name, f"{value}", "100", "1", "5", "", bound]

    found = [row(NOMINAL, "ppo", -32.0, "-30"), row("0", "ppo", -10.0, "-9"), row("1", "ppo", -20.0, "")]
    lines = table(found).splitlines()[2:]
    assert lines[0] == "| nominal, elbows 2 | PPO, 24 V | -32.00 | -30.00 | 100 | 1.00 | 5.00 |"
    # A mean over some of the bounds would be of other tasks than the return's.
    assert lines[1] == "| mean of 2 drawn, elbows 2 | PPO, 24 V | -15.00 |  | 100 | 1.00 | 5.00 |"

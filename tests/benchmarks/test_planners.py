"""Planners' table: tasks drawn in a fixed order, rows that are the players' own, and means."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.metrics import metrics
from agents.evaluation.player import player_of
from agents.evaluation.players import find_player
from agents.evaluation.recording import record
from benchmarks.planners import HEADER, NOMINAL, Task, drawn_tasks, play, playable, table
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


def test_row_is_the_players_own_episode_with_the_bound_beside_it():
    player = player_of("still", find_player("ppo", 2).settings, Still)
    row = dict(zip(HEADER, play(Task(NOMINAL, 2, {"start_noise": 0.0, "duration": 2.1}), player), strict=True))
    expected = metrics(record(replace(player.settings, start_noise=0.0, duration=2.1), Still, [0]))
    assert float(row["return [-]"]) == pytest.approx(expected["return"][0], rel=1e-5)
    assert float(row["energy [J]"]) == pytest.approx(expected["electrical_energy"][0], rel=1e-5)
    assert float(row["decision [ms]"]) > 0.0
    assert row["failures [-]"] == 3
    assert float(row["bound [-]"]) == pytest.approx(-30.1, abs=0.1)


def test_table_has_nominal_rows_and_means_of_the_drawn_ones():
    def row(task, name, value, bound):
        return [task, 2, name, f"{value}", "100", "1", "5", "", bound]

    found = [row(NOMINAL, "ppo", -32.0, "-30"), row("0", "ppo", -10.0, "-9"), row("1", "ppo", -20.0, "")]
    lines = table(found).splitlines()[2:]
    assert lines[0] == "| nominal, elbows 2 | PPO, 24 V | -32.00 | -30.00 | 100 | 1.00 | 5.00 |"
    # A mean over some of the bounds would be of other tasks than the return's.
    assert lines[1] == "| mean of 2 drawn, elbows 2 | PPO, 24 V | -15.00 |  | 100 | 1.00 | 5.00 |"

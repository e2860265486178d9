"""Optima of the evaluation tasks: digests that outlive a processor, and a file that a run goes on from."""

from types import SimpleNamespace

import pytest

from agents.jobs.machines import Machines
from benchmarks.tasks import optima as module
from benchmarks.tasks.optima import SOLVED, UNITS, Solved, digest_of, file_of, optimal_figures, read, solve, write
from benchmarks.tasks.task_set import EVALUATION, TaskSet
from elbow_gym import evaluation_tasks

TASK = {"circle": {"radius": 0.1, "direction": "clockwise"}, "parameters": {"payload": 0.2}, "state": {"q": [0.3, 1.0]}}
OTHER = {**TASK, "parameters": {"payload": 0.1}}


@pytest.fixture
def two_tasks(monkeypatch):
    monkeypatch.setattr(TaskSet, "numbered", lambda *_: {0: TASK, 1: OTHER})
    monkeypatch.setattr(module, "settings_of_task", lambda elbows, task: (elbows, task["parameters"]["payload"]))


def test_digest_is_of_the_task_but_for_the_last_digits():
    nearly = {**TASK, "state": {"q": [0.3 + 1e-14, 1.0]}}
    assert digest_of(2, nearly) == digest_of(2, TASK)
    different = [digest_of(1, TASK), digest_of(2, OTHER), digest_of(2, {**TASK, "state": {"q": [0.3 + 1e-7, 1.0]}})]
    assert len({digest_of(2, TASK), *different}) == 4


def test_rows_of_tasks_that_have_changed_are_dropped(two_tasks, tmp_path):
    figures = dict.fromkeys(UNITS, 1.5)
    known = {(2, 0): Solved(digest_of(2, TASK), SOLVED, 2, figures), (1, 1): Solved(digest_of(1, OTHER), "too far", 2)}
    path = tmp_path / "optima.csv"
    write(path, {**known, (2, 1): Solved(digest_of(2, TASK), SOLVED, 2, figures)})
    assert read(path) == known
    assert optimal_figures(path=path) == {(2, 0): figures}
    assert read(tmp_path / "none.csv") == {}


def test_other_tasks_have_a_file_of_their_own_and_no_optimum_of_the_evaluation_tasks():
    other = TaskSet(7)
    assert [file_of(one).name for one in (EVALUATION, other)] == ["tasks_optima.csv", "tasks_7_optima.csv"]
    assert other.numbered(1)[2] == evaluation_tasks(1, [9])[0]
    assert read(file_of(EVALUATION), other) == {}


def test_a_run_solves_what_is_missing_and_writes_each_task_as_it_is_found(two_tasks, tmp_path, monkeypatch):
    pytest.importorskip("casadi")
    path, asked = tmp_path / "optima.csv", []
    answer = SimpleNamespace(cost=30.0, figures=dict.fromkeys(UNITS, 2.0))

    def bounds(settings, progress, **_):
        asked.append(settings)
        for k, (_, payload) in enumerate(settings):
            progress(k, answer if payload == 0.2 else "the simulator must follow a guess")
            assert read(path)[settings[k][0], 0 if payload == 0.2 else 1].status
        if len(asked) == 1:
            # What was found before a run ends is there.
            raise KeyboardInterrupt

    monkeypatch.setattr(module, "bounds", bounds)
    with pytest.raises(KeyboardInterrupt):
        solve([2], 2, Machines(), path=path)
    said = solve([2, 1], 2, Machines(), path=path)
    # A task that failed is tried again: another version may solve it.
    assert asked == [[(2, 0.2), (2, 0.1)], [(2, 0.1), (1, 0.2), (1, 0.1)]]
    assert optimal_figures(path=path)[1, 0] == {**dict.fromkeys(UNITS, 2.0), "cost": 30.0}
    assert "task 1 with elbows 2 failed: the simulator must follow a guess" in said
    assert said.endswith(f"2 of 4 tasks solved: {path}")


def test_more_starts_solve_again_and_the_cheaper_solution_stays(two_tasks, tmp_path, monkeypatch):
    pytest.importorskip("casadi")
    path, costs, ways = tmp_path / "optima.csv", [[30.0, 20.0], [29.0, 21.0]], []

    def bounds(settings, progress, fresh, starts, **_):
        ways.append((len(settings), fresh, starts))
        for k, cost in enumerate(costs[len(ways) - 1]):
            progress(k, SimpleNamespace(cost=cost, figures=dict.fromkeys(UNITS, cost)))

    monkeypatch.setattr(module, "bounds", bounds)
    for starts in (2, 4, 3):
        solve([2], starts, Machines(), path=path)
    assert ways == [(2, False, 2), (2, True, 4)]
    assert [one.figures["cost"] for one in read(path).values()] == [29.0, 20.0]
    assert {one.starts for one in read(path).values()} == {4}

"""Scores on the evaluation tasks, by hand, and the tables and the figure that are made of them."""

import csv

import numpy as np
import pytest

from benchmarks.tasks import run as module
from benchmarks.tasks.contenders import Contender
from benchmarks.tasks.episodes import DISTURBANCES, NOMINAL, UNITS
from benchmarks.tasks.report import disturbed_table, figure, table, write_scores
from benchmarks.tasks.run import _check_whole, tasks
from benchmarks.tasks.scores import scores
from benchmarks.tasks.task_set import TaskSet

OPTIMA = {(2, number): {"cost": 10.0 + number, "energy": 100.0, "error_rms": 1.0} for number in range(10)}


def episodes_of(costs, complete=1.0):
    return {number: dict(zip(UNITS, (cost, 200.0, 5.0, 0.5, complete), strict=True)) for number, cost in costs.items()}


def relative(factor):
    return {number: factor * (10.0 + number) for number in range(10)}


@pytest.fixture
def episodes():
    """A PD twice as dear as the optimum, and two seeds of a policy 10 % and 20 % off, the second worse on one task."""
    pd, first, second = Contender("pd", 2), Contender("ppo", 2, seed=0), Contender("ppo", 2, seed=1)
    return {
        (pd, NOMINAL): episodes_of(relative(2.0)),
        (pd, "delay"): episodes_of(relative(2.5)),
        (first, NOMINAL): episodes_of(relative(1.1)),
        (first, "delay"): episodes_of(relative(1.15)),
        (second, NOMINAL): episodes_of({**relative(1.2), 9: 60.0}),
        (second, "delay"): episodes_of({**relative(1.25), 9: 60.0}),
        # A task that has no optimum counts nowhere.
        (Contender("pd", 1), NOMINAL): episodes_of(relative(2.0)),
    }


def test_scores_are_those_of_the_hand_calculation(episodes):
    ppo, pd = scores(episodes, OPTIMA)
    assert (ppo.name, pd.name, ppo.elbows) == ("ppo", "pd", 2)
    assert ppo.gaps.shape == (2, 10)
    assert ppo.gaps[1, 9] == pytest.approx(60.0 / 19.0 - 1.0)
    # Ten gaps of 10 %, nine of 20 % and one of 216 %: the tenth, the mean of the middle ten, and the eighteenth.
    assert ppo.median.value == pytest.approx(0.1)
    assert ppo.middle.value == pytest.approx(0.15)
    assert ppo.tail.value == pytest.approx(0.2)
    assert ppo.median.low == pytest.approx(0.1)
    assert ppo.median.high == pytest.approx(0.2)
    assert ppo.share == pytest.approx(0.85)
    assert (ppo.failures, pd.failures) == (1, 0)
    assert (pd.median.value, pd.share) == (pytest.approx(1.0), pytest.approx(0.0))
    assert ppo.losses["delay"].value == pytest.approx(0.05)
    assert pd.losses["delay"].value == pytest.approx(0.5)
    assert (ppo.energy, ppo.error, ppo.below) == (200.0, 5.0, 0.5)


def test_what_the_pd_does_not_finish_is_no_measure_of_a_gain(episodes):
    cut = {key: dict(of) for key, of in episodes.items()}
    cut[Contender("pd", 2), NOMINAL][0] = episodes_of({0: 1e5}, complete=0.0)[0]
    ppo, pd = scores(cut, OPTIMA)
    assert ppo.share == pytest.approx(0.8, abs=0.11)
    assert pd.failures == 1


def test_tables_and_figure_are_of_the_scores(episodes, tmp_path):
    found = scores(episodes, OPTIMA)
    lines = [line.strip("| ").split(" | ") for line in table(found, OPTIMA).splitlines()]
    assert lines[2][:2] == ["2", "optimum, 10 tasks"]
    assert lines[3][1:3] == ["PPO, 24 V", "10.0 [10.0, 20.0] %"]
    assert lines[3][5:] == ["85.0 %", "200", "5.00", "0.50", "1 of 20", "2"]
    assert disturbed_table(found).splitlines()[0] == "| elbows | controller | delay |"
    assert disturbed_table(scores({key: of for key, of in episodes.items() if key[1] == NOMINAL}, OPTIMA)) == ""
    write_scores(found, tmp_path / "tasks.csv")
    with (tmp_path / "tasks.csv").open() as handle:
        rows = list(csv.DictReader(handle))
    assert float(rows[1]["gap_tail [-] low"]) == pytest.approx(found[1].tail.low)
    assert (rows[0]["loss_noise [-]"], rows[0]["tasks [-]"]) == ("", "10")
    figure(found, tmp_path / "tasks.png")
    from matplotlib.image import imread

    assert imread(tmp_path / "tasks.png").shape[1] > 150 * 4


def test_who_played_undisturbed_alone_has_a_gap_and_no_loss(episodes):
    planner = Contender("sampling_mpc_payload", 2)
    found = scores({**episodes, (planner, NOMINAL): episodes_of(relative(1.15))}, OPTIMA)
    assert [one.name for one in found] == ["ppo", planner.name, "pd"]
    assert found[1].losses == {}
    assert [text.count("MPC") for text in (table(found, OPTIMA), disturbed_table(found))] == [1, 0]


def test_planners_play_undisturbed_alone_and_everybody_the_tasks_of_the_set(tmp_path, monkeypatch):
    pytest.importorskip("casadi")
    asked = {}

    def stop(jobs, *_):
        asked.update(jobs)
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "optimal_figures", lambda *_: OPTIMA)
    monkeypatch.setattr(module, "compile_before", lambda *_: None)
    monkeypatch.setattr(module, "do_all", stop)
    drawn = TaskSet(7)
    with pytest.raises(KeyboardInterrupt):
        tasks(tmp_path, [2], planners=True, disturb=True, drawn=drawn)
    ways = {one.name: [name for other, name in asked if other == one] for one, _ in asked}
    assert ways["pd"] == list(DISTURBANCES)
    assert ways["sampling_mpc_payload"] == ways["receding_horizon_payload"] == [NOMINAL]
    (job,) = (job for (one, name), job in asked.items() if (one.name, name) == ("pd", "delay"))
    assert job.size == len(OPTIMA)
    assert job.work.args[1] == {number: drawn.numbered(2)[number] for _, number in OPTIMA}


def test_comparison_needs_an_optimum_and_writes_what_it_says(episodes, tmp_path, monkeypatch):
    with pytest.raises(ValueError, match=r"none\.csv must hold an optimum for the elbows \[2\], got none; --solve"):
        tasks(tmp_path, [2], optima=tmp_path / "none.csv")
    monkeypatch.setattr(module, "optimal_figures", lambda *_: OPTIMA)
    monkeypatch.setattr(module, "_episodes", lambda *_: episodes)
    text = tasks(tmp_path, [2])
    assert text.startswith((tmp_path / "tasks.md").read_text())
    assert (tmp_path / "tasks_disturbed.md").read_text() in text
    with (tmp_path / "tasks_episodes.csv").open() as handle:
        rows = list(csv.DictReader(handle))
    assert len(rows) == sum(map(len, episodes.values()))
    assert np.mean([float(row["energy [J]"]) for row in rows]) == 200.0
    known = {key: of for key, of in episodes.items() if key[1] == NOMINAL}
    monkeypatch.setattr(module, "_episodes", lambda *_: known)
    tasks(tmp_path, [2])
    assert not (tmp_path / "tasks_disturbed.md").exists()
    tasks(tmp_path, [2], drawn=TaskSet(7))
    assert (tmp_path / "tasks_7.md").read_text() == (tmp_path / "tasks.md").read_text()
    assert (tmp_path / "tasks_7.csv").is_file()


@pytest.mark.parametrize(
    "part",
    [{"planners": False}, {"disturb": False}, {"elbows": [2, 1]}, {"guests": ["ppo"]}],
    ids=lambda part: next(iter(part)),
)
def test_the_evaluation_is_published_as_a_whole(tmp_path, part):
    whole = {"elbows": [2, 1, 0], "planners": True, "disturb": True}
    with pytest.raises(ValueError, match=r"^--publish must be given with --planners and --disturb and without --with"):
        tasks(tmp_path, **{**whole, **part}, publish=True)


def test_a_whole_evaluation_is_published():
    _check_whole([0, 1, 2], [], planners=True, disturb=True)

"""The race against the PD: what is measured, when, and who wins."""

import csv
from pathlib import Path

import numpy as np
import pytest

from agents.recipes import race
from agents.shipped.seeds import load_policy

RESULTS = Path(__file__).parents[3] / "benchmarks" / "results"


def idle(observation):
    return np.zeros((len(observation), 10), dtype=np.float32)


@pytest.fixture(scope="module")
def pd():
    """The PD's metrics, which take a second."""
    return race.Race().pd


@pytest.mark.slow
def test_shipped_policy_beats_the_pd_and_an_idle_arm_does_not(pd):
    found = race.Race(every=100)
    found.pd = pd
    assert not found(100, idle)
    assert found.beaten is None
    policy = load_policy("ppo", elbows=2)
    assert found(250, lambda observation: policy.predict(observation)[0])
    assert found.beaten is found.marks[1]
    assert found.beaten.steps == 250
    assert found.verdict().startswith("PD beaten after 250 steps")


def test_a_policy_must_be_below_the_pd_in_both_energy_and_error():
    found = race.Race(every=1)
    found.pd = {"electrical_energy": 100.0, "steady_error_rms_mm": 10.0, "return": -80.0}
    for energy, error, beaten in ((99.0, 10.0, False), (100.0, 9.0, False), (99.0, 9.0, True)):
        found.marks = [race.Mark(1, 1.0, 1.0, {"electrical_energy": energy, "steady_error_rms_mm": error})]
        assert (found.beaten is not None) == beaten


def test_evaluations_come_once_every_so_many_control_periods_and_do_not_count_as_training(monkeypatch):
    now = [0.0]

    def evaluation(*_):
        now[0] += 100.0
        return {"return": -1.0}

    monkeypatch.setattr(race, "clocks", lambda: (now[0], 2.0 * now[0]))
    monkeypatch.setattr(race, "controller_evaluation", evaluation)
    monkeypatch.setattr(race, "sentence", str)
    found = race.Race(every=100, stop=False)
    for steps in (60, 120, 180, 240):
        now[0] += 1.0
        found(steps, idle)
    assert [(mark.steps, mark.seconds, mark.wall) for mark in found.marks] == [(120, 2.0, 4.0), (240, 4.0, 8.0)]


def test_an_actor_that_breaks_the_simulation_has_lost_and_training_goes_on(monkeypatch):
    def evaluation(*_):
        raise ArithmeticError

    monkeypatch.setattr(race, "controller_evaluation", evaluation)
    found = race.Race(every=1)
    found.pd = {"electrical_energy": 1e9, "steady_error_rms_mm": 1e9, "return": -1e9}
    assert not found(1, idle)
    assert found.marks[0].figures["return"] == -np.inf
    assert found.marks[0].figures.keys() == load_policy("ppo", elbows=2).card.evaluation.keys() - {"seeds"}


@pytest.mark.parametrize("stop", [True, False])
def test_training_goes_on_after_the_pd_is_beaten_when_it_is_to(monkeypatch, stop):
    monkeypatch.setattr(race, "controller_evaluation", lambda *_: dict.fromkeys(race.LOST, 1.0))
    found = race.Race(every=1, stop=stop)
    found.pd = {"electrical_energy": 2.0, "steady_error_rms_mm": 2.0}
    assert found(1, idle) is stop
    assert found.beaten is found.marks[0]


def test_race_refuses_an_interval_that_is_not_positive():
    with pytest.raises(ValueError, match="every must be positive, got 0"):
        race.Race(every=0)


@pytest.mark.slow
def test_pd_of_the_race_is_the_energy_benchmarks_within_the_spread_of_the_seeds(pd):
    with (RESULTS / "energy.csv").open(encoding="utf-8") as handle:
        rows = {(r["controller"], r["elbows"], r["regime"]): r for r in csv.DictReader(handle)}
    assert pd["electrical_energy"] == pytest.approx(float(rows["pd", "2", "A"]["electrical_energy [J]"]), rel=0.05)
    assert pd["steady_error_rms_mm"] == pytest.approx(float(rows["pd", "2", "B"]["error_rms [mm]"]), rel=0.01)

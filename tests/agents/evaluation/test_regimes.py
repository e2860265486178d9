"""Episodes from several starts side by side are those of each start alone, bit for bit."""

import re
from dataclasses import fields, replace

import numpy as np
import pytest

from agents.__main__ import app
from agents.evaluation.metrics import REGIMES, metrics
from agents.evaluation.players import TABLE_ENV, find_player
from agents.evaluation.recording import Recording, record, record_starts
from agents.evaluation.regimes import in_all_regimes, recordings

SEEDS = (20_000, 20_001, 20_002)
STARTS = ("paper", "on_target")


def assert_same(one, other):
    assert one.settings == other.settings
    assert one.seeds == other.seeds
    for field in fields(Recording):
        if field.name not in ("settings", "seeds"):
            np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name), err_msg=field.name)


@pytest.mark.parametrize(
    ("name", "elbows", "env"),
    [("pd_paper", 2, "ElbowArm-v0"), ("pd_gravity", 1, "ElbowArm-v0"), ("computed_torque", 0, TABLE_ENV)],
)
def test_starts_side_by_side_are_those_of_each_alone(name, elbows, env):
    player = find_player(name, elbows, env)
    settings = replace(player.settings, duration=0.1)
    together = record_starts(settings, STARTS, player.make, SEEDS)
    assert list(together) == list(STARTS)
    for start in STARTS:
        assert_same(together[start], record(replace(settings, start=start), player.make, SEEDS))
    assert (together["paper"].q[0] != together["on_target"].q[0]).any()


def test_starts_side_by_side_keep_each_arms_generator():
    player = find_player("pd", 2)
    settings = replace(player.settings, duration=0.02, randomize={"sensor_noise": [0.01, 0.02], "payload": [0.0, 0.2]})
    together = record_starts(settings, STARTS, player.make, SEEDS)
    for start in STARTS:
        assert_same(together[start], record(replace(settings, start=start), player.make, SEEDS))


@pytest.mark.parametrize("name", ["pd", "ppo"])
def test_progress_counts_all_starts_together(name):
    player = find_player(name, 2)
    player = replace(player, settings=replace(player.settings, duration=0.5))
    told = []
    recordings(player, STARTS, SEEDS, lambda done, total: told.append(done / total))
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert told.count(1.0) == 1


def test_regimes_are_counted_from_the_episodes_of_their_start():
    player = find_player("ppo", 2)
    player = replace(player, settings=replace(player.settings, duration=2.2))
    results = in_all_regimes(player, SEEDS)
    for regime in REGIMES:
        alone = record(replace(player.settings, start=regime.start), player.make, SEEDS)
        np.testing.assert_array_equal(results[regime.name]["return"], metrics(alone, regime.since)["return"])
    assert list(in_all_regimes(player, SEEDS, regimes=REGIMES[:1])) == ["A"]


def test_bar_of_the_command_ends_at_100_percent_and_shows_no_other(monkeypatch, capsys):
    def play(player, seeds, progress):
        for done in (0, 125, 250, 500):
            progress(done, 500)

    monkeypatch.setattr("agents.evaluation.command.in_all_regimes", play)
    monkeypatch.setattr("agents.evaluation.command.print_results", lambda *_: None)
    app.run(["evaluate", "pd", "--episodes", "1"])
    percents = [int(percent) for percent in re.findall(r"(\d+)%", capsys.readouterr().err)]
    assert percents[-1] == max(percents) == 100

"""The short and the full benchmark: what they play, what they take over, and where they write."""

import json
import subprocess

import numpy as np
import pytest
from PIL import Image
from scipy import stats

from agents.evaluation.interquartile import CONFIDENCE, RESAMPLES, interquartile_mean
from agents.evaluation.regimes import BENCHMARK_SEEDS
from benchmarks.energy import run
from benchmarks.energy.cells import Cell, cells, players
from benchmarks.energy.run import LQR_ARMS, Plan, batches, energy, measure, plan
from benchmarks.machine import LATEST, LATEST_SPEED, RESULTS


def test_short_run_plays_the_nominal_part_with_the_best_training_seed():
    chosen = plan(full=False)
    assert {cell.part for cell in chosen.cells} == {"nominal"}
    assert {cell.gain for cell in chosen.cells} == {1.0}
    assert {cell.elbows for cell in chosen.cells} == {2, 1, 0}
    assert list(chosen.seeds) == list(BENCHMARK_SEEDS[:3])
    for cell in chosen.cells:
        assert len(players(cell, chosen.every_seed)) == 1


def test_full_run_plays_all_parts_poses_and_training_seeds():
    chosen = plan(full=True)
    assert {cell.part for cell in chosen.cells} == {"nominal", "shifted", "table"}
    assert len({cell.gain for cell in chosen.cells}) == 5
    assert tuple(chosen.seeds) == BENCHMARK_SEEDS
    assert len(players(Cell("ppo", 2), chosen.every_seed)) == 5


def test_no_episodes_are_refused():
    with pytest.raises(ValueError, match=r"^episodes must be positive, got 0"):
        plan(full=False, episodes=0)


def test_kernels_that_are_compiled_before_are_those_of_the_batches_that_run():
    chosen = plan(full=False)
    arms = {(settings.table, count) for settings, count in batches(chosen.cells, chosen)}
    # Three poses, twice as many with both starts side by side, the LQR's nudges, and one arm whose decisions are timed.
    assert arms == {(False, 1), (False, 3), (False, 6), (False, LQR_ARMS)}
    tabletop = [settings.table for settings, _ in batches(cells(["table"]), chosen)]
    assert set(tabletop) == {True}


def test_a_run_that_was_made_before_starts_no_process_and_compiles_nothing(tmp_path, monkeypatch):
    chosen = Plan([Cell("ppo", 2), Cell("clone", 1)], [20_000], every_seed=False, folder=tmp_path)
    rows = measure(chosen, parallel=False)
    for name in ("compile_before", "do_all", "in_all_regimes"):
        monkeypatch.setattr(run, name, lambda *_: pytest.fail("made again"))
    assert measure(chosen) == rows


@pytest.mark.slow
def test_short_run_writes_its_tables_and_figure_and_prints_where(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(run, "cells", lambda parts: [Cell("ppo", 2), Cell("lqr", 2)])
    rows = energy(tmp_path / "out", episodes=1, folder=tmp_path / "cache", parallel=False, command="as typed")
    assert [(row.controller, row.regime) for row in rows] == [(name, r) for name in ("ppo", "lqr") for r in "ABC"]
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {"energy.csv", "energy.md", "energy.json", "energy.png", "effort.csv"}
    assert json.loads((tmp_path / "out" / "energy.json").read_text())["command"] == "as typed"
    with Image.open(tmp_path / "out" / "energy.png") as picture:
        assert picture.size[0] >= 1500  # sharp at the README's 900 pixels
        assert min(picture.info["dpi"]) >= 150
    lines = capsys.readouterr().out.splitlines()
    assert max(len(line) for line in lines) <= 80
    assert any("PPO, 24 V" in line for line in lines)


@pytest.mark.parametrize("folder", [LATEST, LATEST_SPEED])
def test_results_that_are_not_published_lie_where_git_does_not_look(folder):
    inside = subprocess.run(["git", "rev-parse", "HEAD"], cwd=RESULTS, capture_output=True, check=False)
    if inside.returncode:
        pytest.skip("no git checkout")
    ignored = subprocess.run(["git", "check-ignore", "-q", folder / "results.csv"], cwd=RESULTS, check=False)
    assert ignored.returncode == 0


@pytest.mark.parametrize("shape", [(1, 20), (5, 4)])
def test_interval_is_that_of_scipys_trimmed_means_of_the_resamples(shape):
    samples = np.random.default_rng(3).normal(size=shape)
    seeds, episodes = shape
    rng = np.random.default_rng(0)
    chosen = rng.integers(seeds, size=(RESAMPLES, seeds))
    drawn = rng.integers(episodes, size=(RESAMPLES, seeds, episodes))
    means = stats.trim_mean(samples[chosen[..., None], drawn].reshape(RESAMPLES, -1), 0.25, axis=1)
    low, high = np.quantile(means, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    estimate = interquartile_mean(samples)
    assert estimate.value == pytest.approx(stats.trim_mean(samples.ravel(), 0.25))
    assert (estimate.low, estimate.high) == pytest.approx((low, high))

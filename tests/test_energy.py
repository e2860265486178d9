"""The energy benchmark: its statistics by hand, its files, and that the committed ones agree with each other."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agents.evaluate import SHIFTED
from agents.metrics import REGIMES, UNITS
from agents.pd import CLIPPED, PDController
from agents.recording import record
from benchmarks import energy
from benchmarks.statistics import interquartile_mean
from elbow_gym.settings import Settings


def test_interquartile_mean_drops_the_outer_quarters():
    estimate = interquartile_mean([100.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, -50.0])
    assert estimate.value == pytest.approx(np.mean([2.0, 3.0, 4.0, 5.0]))
    assert estimate.low < estimate.value < estimate.high


def test_interval_narrows_with_the_samples_and_is_reproducible():
    rng = np.random.default_rng(0)
    few, many = interquartile_mean(rng.normal(size=10)), interquartile_mean(rng.normal(size=1000))
    assert many.high - many.low < 0.3 * (few.high - few.low)
    assert interquartile_mean(np.arange(9.0)) == interquartile_mean(np.arange(9.0))


def test_equal_or_single_samples_have_no_spread_and_none_are_refused():
    assert interquartile_mean([2.0]) == interquartile_mean([2.0, 2.0, 2.0]) == (2.0, 2.0, 2.0)
    assert np.isnan(interquartile_mean([np.nan, 1.0]).value)
    with pytest.raises(ValueError, match="samples must hold at least one value, got none"):
        interquartile_mean([])


def test_benchmark_writes_table_figure_and_context(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(energy, "cells", lambda: [("pd_24v", 2), ("ppo", 2)])
    rows = energy.energy(tmp_path, episodes=2)
    assert [row.regime for row in rows] == ["A", "B", "C"] * 2 + ["A", "B"] * 2
    assert [row.shifted for row in rows] == [False] * 6 + [True] * 4
    written_files = ["energy.csv", "energy.json", "energy.md", "energy.png"]
    written_files += ["energy_shifted.csv", "energy_shifted.md", "pareto.png"]
    assert sorted(path.name for path in tmp_path.iterdir()) == written_files
    with (tmp_path / "energy.csv").open() as handle:
        written = list(csv.DictReader(handle))
    assert float(written[0]["electrical_energy [J]"]) == pytest.approx(
        sum(float(written[0][f"electrical_energy_joint_{k} [J]"]) for k in range(1, 11)), rel=0.05
    )
    assert json.loads((tmp_path / "energy.json").read_text())["seeds"] == [20_000, 20_001]
    assert "PD, 24 V" in capsys.readouterr().out


def test_gap_is_the_excess_over_the_bound_where_there_is_one(monkeypatch):
    monkeypatch.setattr(energy, "bound", lambda elbows, regime: 20.0 if regime.name == "A" else None)
    figures = {"return": interquartile_mean([-30.0])}
    assert energy.gap(energy.Row("pd_24v", 2, "A", figures, ())) == pytest.approx(0.5)
    assert energy.gap(energy.Row("pd_24v", 2, "B", figures, ())) is None
    assert energy.gap(energy.Row("pd_24v", 2, "A", figures, (), shifted=True)) is None


def test_lqr_stays_within_five_percent_of_the_bound_at_every_elbow_count():
    gaps = {int(row["elbows"]): row for row in committed() if row["controller"] == "lqr" and row["regime"] == "A"}
    assert sorted(gaps) == [0, 1, 2]
    for row in gaps.values():
        assert float(row["optimality_gap [-]"]) < 0.05


def committed():
    with (Path(energy.__file__).parent / "results/energy.csv").open() as handle:
        return list(csv.DictReader(handle))


def test_committed_results_hold_every_cell_and_regime():
    found = {(row["controller"], int(row["elbows"]), row["regime"]) for row in committed()}
    assert found == {(name, elbows, regime.name) for name, elbows in energy.cells() for regime in REGIMES}


def test_committed_table_is_made_of_the_committed_figures():
    lines = (energy.RESULTS / "energy.md").read_text().splitlines()[2:]
    for line, row in zip(lines, committed(), strict=True):
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        value = float(row["electrical_energy [J]"])
        assert float(cells[3].split()[0]) == pytest.approx(value, rel=1e-3)
        assert float(cells[5].split()[0]) == pytest.approx(float(row["error_rms [mm]"]), rel=1e-3)
    assert set(UNITS) <= {name.split(" ")[0] for name in committed()[0]}


def test_shifted_set_asks_for_what_the_nominal_one_does_not_have():
    nominal, shifted = Settings(), replace(Settings(), **SHIFTED)
    assert shifted.start_noise > nominal.start_noise
    assert {"radius", "period", "phase"} <= set(shifted.parsed_circle.drawn)
    assert shifted.randomization.lowest("payload") > nominal.payload
    with (energy.RESULTS / "energy_shifted.csv").open() as handle:
        found = {(row["controller"], int(row["elbows"]), row["regime"]) for row in csv.DictReader(handle)}
    assert found == {(name, elbows, regime) for name, elbows in energy.shifted_cells() for regime in "AB"}


def test_pd_on_drawn_circles_tracks_each_arms_own():
    settings = Settings(**CLIPPED, circle=SHIFTED["circle"], start_noise=0.0)
    recording = record(settings, PDController, [1, 2, 3], every=100)
    error = np.linalg.norm(recording.hand - recording.target, axis=-1)
    assert (error[-1] < 0.03).all()
    assert np.ptp(recording.target[-1], axis=0).max() > 0.02

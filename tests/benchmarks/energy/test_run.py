"""The energy benchmark: its statistics by hand, its files, and that the committed ones agree with each other."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation import players
from agents.evaluation.interquartile import interquartile_mean
from agents.evaluation.recording import record
from agents.evaluation.regimes import SHIFTED
from agents.style import CONTROLLER_COLOURS, CONTROLLER_MARKERS, CONTROLLER_NAMES
from benchmarks.energy import cache, pareto
from benchmarks.energy import cells as lineup
from benchmarks.energy import run as energy
from benchmarks.energy.cells import Cell
from benchmarks.energy.run import Plan
from elbow_gym.baselines.pd import CLIPPED, PDController
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv
from tests.support.workers import in_this_process

STYLES = (CONTROLLER_COLOURS, CONTROLLER_NAMES, CONTROLLER_MARKERS)


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


def test_interval_of_few_seeds_is_wider_than_that_of_their_episodes():
    seeds = np.repeat([[1.0], [2.0], [3.0], [4.0]], 50, axis=1)
    together, apart = interquartile_mean(seeds), interquartile_mean(seeds.ravel())
    assert together.value == apart.value == pytest.approx(2.5)
    assert together.high - together.low > 3.0 * (apart.high - apart.low)


QUICK = [Cell("ppo", 2), Cell("ppo", 2, "shifted"), Cell("ppo", 0, "table")]


@pytest.fixture(scope="module", autouse=True)
def two_seeds():
    """Of each learned controller the first two training seeds are enough here."""
    shipped = players.shipped_seeds
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(players, "shipped_seeds", lambda name: shipped(name)[:2])
        yield


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("energy")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(energy, "cells", lambda: QUICK)
        patch.setattr(energy, "sweep", list)
        patch.setattr(energy.learning, "save", lambda folder: None)
        rows = energy.energy(folder, episodes=2, full=True, folder=folder / "cache", parallel=False)
    return folder, rows


@pytest.mark.slow
def test_benchmark_writes_tables_figures_and_context(measured):
    folder, rows = measured
    assert [row.regime for row in rows] == ["A", "B", "C", "A", "B", "A", "B", "C"]
    assert [row.part for row in rows] == ["nominal"] * 3 + ["shifted"] * 2 + ["table"] * 3
    stems = ("energy", "energy_shifted", "energy_table")
    expected = {f"{stem}.{suffix}" for stem in stems for suffix in ("csv", "md")}
    expected |= {
        "energy_brief.md",
        "energy_short.md",
        "effort.csv",
        "energy.json",
        "energy.png",
        "energy_joints.png",
        "energy_seeds.csv",
        "pareto.png",
        "pareto_gains.csv",
    }
    assert {path.name for path in folder.iterdir()} == expected | {"cache"}
    with (folder / "energy.csv").open() as handle:
        written = list(csv.DictReader(handle))
    assert float(written[0]["electrical_energy [J]"]) == pytest.approx(
        sum(float(written[0][f"electrical_energy_joint_{k} [J]"]) for k in range(1, 11)), rel=0.05
    )
    assert int(written[0]["training_seeds [-]"]) == len(players.shipped_seeds("ppo_elbows2"))
    assert json.loads((folder / "energy.json").read_text())["seeds"] == [20_000, 20_001]
    with (folder / "energy_seeds.csv").open() as handle:
        assert {row["seed"] for row in csv.DictReader(handle)} == {
            str(seed) for seed in players.shipped_seeds("ppo_elbows2")
        }


def rows_of(cell, folder, seeds=(20_000, 20_001), fresh=False, tell=lambda _: None):
    return energy.played_rows(cell, Plan([cell], seeds, folder=folder, fresh=fresh), tell)


@pytest.mark.slow
def test_interrupted_benchmark_goes_on(measured, monkeypatch):
    folder, rows = measured
    cached = folder / "cache"
    monkeypatch.setattr(energy, "in_all_regimes", lambda *_, **__: pytest.fail("measured again"))
    assert rows_of(QUICK[0], cached) == rows[:3]
    for change in ({"seeds": [20_000, 20_002]}, {"fresh": True}):
        with pytest.raises(pytest.fail.Exception, match="measured again"):
            rows_of(QUICK[0], cached, **change)
    monkeypatch.setattr(cache, "code", lambda: "other code")
    with pytest.raises(pytest.fail.Exception, match="measured again"):
        rows_of(QUICK[0], cached)


@pytest.mark.slow
def test_progress_tells_all_of_the_work_once(measured, tmp_path):
    for folder in (tmp_path, measured[0] / "cache"):
        told = []
        rows_of(QUICK[0], folder, tell=told.append)
        assert sum(told) == lineup.work(QUICK[0])


@pytest.mark.slow
def test_cells_sent_to_processes_are_those_played_here(measured, monkeypatch):
    folder, rows = measured
    monkeypatch.setattr(energy, "do_all", in_this_process)
    assert energy.measure(Plan(QUICK[:1], [20_000, 20_001], folder=folder / "other")) == rows[:3]


@pytest.mark.slow
def test_gap_is_the_excess_over_the_bound_where_there_is_one(measured, monkeypatch):
    cached = measured[0] / "cache"
    monkeypatch.setattr(energy, "cached_bound", lambda _: {"closed_loop": 20.0})
    whole, late, on_target = rows_of(QUICK[0], cached)
    assert whole.gap == pytest.approx(-whole.figures["return"].value / 20.0 - 1.0)
    assert on_target.gap is not None
    assert late.gap is None
    assert all(row.gap is None for row in rows_of(QUICK[1], cached))


def test_lineup_finds_what_is_shipped(monkeypatch):
    names = [
        "ppo_elbows2_seed0",
        "ppo_elbows2_seed3",
        "ppo_cloned_elbows0_seed1",
        "sac_random_seed0",
        "ppo_table_seed2",
    ]
    monkeypatch.setattr(players, "shipped_policies", lambda: names)
    nominal = {Cell("ppo", 2), Cell("ppo_cloned", 0), Cell("sac_random", 2)}
    everyone = lineup.cells()
    classical = {*players.CLASSICAL, "lqr"}
    learned = {cell for cell in everyone if cell.controller not in classical}
    assert learned == {*nominal, *(replace(cell, part="shifted") for cell in nominal), Cell("ppo", 0, "table")}
    assert {cell.controller for cell in everyone if cell.part == "table"} >= {"ppo", "pd", "computed_torque"}
    assert len(everyone) == len(set(everyone))
    assert all(name in style for cell in everyone for name in [cell.controller] for style in STYLES)


def test_table_part_is_played_on_the_table_and_a_gain_multiplies_both_of_the_papers():
    [player] = lineup.players(Cell("pd", 0, "table"))
    assert player.settings.table is True
    assert player.settings.elbows == 0
    assert player.settings.timestep is None
    [player] = lineup.players(Cell("pd", 1, gain=4.0))
    controller = player.make(ElbowArmVectorEnv(1, **player.settings.arguments))
    assert (controller.kp, controller.kd) == (4.0 * 500.0, 4.0 * 20.0)
    assert player.settings.table is False


def test_gain_family_runs_from_soft_to_stiff(tmp_path):
    figures = {"error_mean": interquartile_mean([1.0]), "electrical_energy": interquartile_mean([2.0])}
    rows = [energy.Row("pd", 2, "A", figures, (), gain=gain) for gain in (1.0, 4.0, 0.25)]
    rows += [energy.Row("ppo", 2, "A", figures, ()), energy.Row("pd", 2, "B", figures, ())]
    places = pareto.marks(rows)
    assert [mark.gain for mark in pareto.gain_family(places, 2)] == [0.25, 1.0, 4.0]
    pareto.write_gains(places, tmp_path / "gains.csv")
    assert len((tmp_path / "gains.csv").read_text().splitlines()) == 4


def test_shifted_set_asks_for_what_the_nominal_one_does_not_have():
    nominal, shifted = Settings(), replace(Settings(), **SHIFTED)
    assert shifted.start_noise > nominal.start_noise
    assert {"radius", "period", "phase"} <= set(shifted.parsed_circle.drawn)
    assert shifted.randomization.lowest("payload") > nominal.payload


@pytest.mark.slow
def test_pd_on_drawn_circles_tracks_each_arms_own():
    settings = Settings(**CLIPPED, circle=SHIFTED["circle"], start_noise=0.0, duration=3.0)
    recording = record(settings, PDController, [1, 2, 3], every=100)
    error = np.linalg.norm(recording.hand - recording.target, axis=-1)
    assert (error[-1] < 0.03).all()
    assert np.ptp(recording.target[-1], axis=0).max() > 0.02

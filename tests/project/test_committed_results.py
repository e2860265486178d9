"""Committed results agree with each other, with the code that makes them, and with what is said of them.

Red here means that a result is older than the code or than another result: regenerate it, with `python -m benchmarks
energy`, `python -m benchmarks optimal`, or a training and `python -m agents publish`.
"""

import csv
from dataclasses import replace

import numpy as np
import pytest

from agents.control.lqr import TimeVaryingLQR
from agents.control.trajectory import OpenLoop, Trajectory
from agents.evaluation.interquartile import interquartile_mean
from agents.evaluation.metrics import REGIMES, UNITS
from agents.evaluation.players import ELBOW_COUNTS, find_player
from agents.evaluation.receipt import player_again, read_receipt
from agents.evaluation.regimes import BENCHMARK_SEEDS
from agents.learning.evaluation import evaluation
from agents.optimal import certificate
from agents.optimal.guesses import rollout
from agents.shipped import RECEIPTS
from agents.shipped import seeds as shipped
from agents.shipped.seeds import load_policy, shipped_policies
from agents.style import CONTROLLER_NAMES
from benchmarks.energy import breakdown, pareto
from benchmarks.energy import cells as lineup
from benchmarks.machine import RESULTS
from benchmarks.optimal import DEFAULT_WEIGHT, FRONT_WEIGHTS, Cell, cached, cells, files
from benchmarks.tasks import optima
from benchmarks.tasks.task_set import EVALUATION, TaskSet
from elbow_gym import ElbowArmEnv
from elbow_gym.baselines import policy as baselines
from elbow_gym.baselines.policy import pair, read_policy
from elbow_gym.kinematics import joint_positions


def committed():
    with (RESULTS / "energy.csv").open() as handle:
        return list(csv.DictReader(handle))


def test_committed_results_hold_every_cell_and_regime():
    found = {(row["controller"], int(row["elbows"]), row["regime"]) for row in committed()}
    nominal = [cell for cell in lineup.cells() if cell.part == "nominal"]
    assert found == {(cell.controller, cell.elbows, regime.name) for cell in nominal for regime in REGIMES}


def test_committed_table_is_made_of_the_committed_figures():
    lines = (RESULTS / "energy.md").read_text().splitlines()[2:]
    for line, row in zip(lines, committed(), strict=True):
        entries = [entry.strip() for entry in line.strip("|").split("|")]
        value = float(row["electrical_energy [J]"])
        assert float(entries[3].split()[0]) == pytest.approx(value, rel=1e-3)
        assert float(entries[5].split()[0]) == pytest.approx(float(row["error_rms [mm]"]), rel=1e-3)
    assert set(UNITS) <= {name.split(" ")[0] for name in committed()[0]}


def test_committed_brief_table_puts_the_regimes_of_the_committed_figures_side_by_side():
    by_key = {(row["elbows"], CONTROLLER_NAMES[row["controller"]], row["regime"]): row for row in committed()}
    lines = [line.strip("| ").split(" | ") for line in (RESULTS / "energy_brief.md").read_text().splitlines()[2:]]
    assert 3 * len(lines) == len(by_key)
    for elbows, name, gain, _, whole, steady, error, on_target, _ in lines:
        for cell, regime, column in (
            (gain, "A", "return [-]"),
            (whole, "A", "electrical_energy [J]"),
            (steady, "B", "electrical_energy [J]"),
            (error, "B", "error_rms [mm]"),
            (on_target, "C", "electrical_energy [J]"),
        ):
            assert float(cell.split()[0]) == pytest.approx(float(by_key[elbows, name, regime][column]), rel=1e-3)
    order = [(int(line[0]), float(line[2].split()[0])) for line in lines]
    assert order == sorted(order, reverse=True)


def test_committed_shifted_results_hold_every_shifted_cell_and_regime():
    with (RESULTS / "energy_shifted.csv").open() as handle:
        found = {(row["controller"], int(row["elbows"]), row["regime"]) for row in csv.DictReader(handle)}
    shifted = [cell for cell in lineup.cells() if cell.part == "shifted"]
    assert found == {(cell.controller, cell.elbows, regime) for cell in shifted for regime in "AB"}


def test_the_front_has_a_point_for_every_price_of_power_and_none_from_under_the_table():
    for elbows in (2, 1, 0):
        points = pareto.front(elbows)
        assert len(points) == 1 + len(FRONT_WEIGHTS)
        assert np.all(np.diff([energy for _, energy in points]) < 0.0)


def test_lqr_stays_within_five_percent_of_the_bound_at_every_elbow_count():
    gaps = {int(row["elbows"]): row for row in committed() if row["controller"] == "lqr" and row["regime"] == "A"}
    assert sorted(gaps) == [0, 1, 2]
    for row in gaps.values():
        assert float(row["optimality_gap [-]"]) < 0.05


def test_committed_breakdown_sums_to_the_energy_that_the_benchmark_found():
    papers = {row["elbows"]: row for row in committed() if row["controller"] == "pd_paper" and row["regime"] == "A"}
    with (RESULTS / "breakdown.csv").open() as handle:
        rows = list(csv.DictReader(handle))
    for elbows in ("0", "1", "2"):
        sums = {row["part"]: float(row["sum [J]"]) for row in rows if row["elbows"] == elbows}
        assert sum(sums[part] for part in breakdown.PARTS) == pytest.approx(sums["whole"], rel=1e-4)
        assert sums["whole"] == pytest.approx(float(papers[elbows]["electrical_energy [J]"]), rel=0.01)


def test_what_may_go_under_the_table_does_and_is_better_for_it(arm):
    for elbows in (1, 0):
        held, free = Cell(elbows), Cell(elbows, under=True)
        lowest = {cell: joint_positions(arm, Trajectory.load(files(cell)[1]).q)[..., 2].min() for cell in (held, free)}
        assert lowest[free] < -0.1 < -1e-3 < lowest[held]
        assert cached(free)["closed_loop"] < cached(held)["closed_loop"]


SOLVED = [pytest.param(cell, id=cell.name) for cell in cells() if cached(cell)]
LQR = [
    pytest.param(cell, id=cell.name, marks=pytest.mark.soak if cell.energy_weight != DEFAULT_WEIGHT else ())
    for cell in cells()
    if cached(cell)
]
"""The same; the LQR takes half a second for each, so that the front's are soak."""


@pytest.mark.soak
@pytest.mark.parametrize("cell", SOLVED)
def test_committed_voltages_repeat_their_cost_in_the_steps_that_they_were_found_in(cell):
    figures, trajectory = cached(cell), Trajectory.load(files(cell)[1])
    settings = replace(cell.problem.settings, integrator="rk4", timestep=0.002)
    found, _ = rollout(settings, lambda env: OpenLoop(env, trajectory))
    assert found == pytest.approx(figures["closed_loop"], rel=1e-9)
    assert found == pytest.approx(figures["predicted_cost"], rel=0.02)


@pytest.mark.parametrize("cell", LQR)
def test_committed_trajectory_costs_the_same_under_the_lqr_whatever_the_integrator(cell):
    # Open loop the arm falls away from it, and what two integrators differ by grows; held to it, it does not.
    trajectory = Trajectory.load(files(cell)[1])
    found, _ = rollout(cell.problem.settings, lambda env: TimeVaryingLQR(env, trajectory))
    assert found == pytest.approx(cached(cell)["closed_loop"], rel=1e-5)


def test_receipts_of_the_pd_are_of_the_committed_figures():
    by_key = {(row["controller"], int(row["elbows"]), row["regime"]): row for row in committed()}
    for elbows in ELBOW_COUNTS:
        receipt = read_receipt(str(RECEIPTS / f"pd_elbows{elbows}.json"))
        assert tuple(receipt["seeds"]) == BENCHMARK_SEEDS
        assert player_again(receipt).settings == find_player("pd", elbows).settings
        for regime, joules in receipt["joules"].items():
            expected = float(by_key["pd", elbows, regime]["electrical_energy [J]"])
            assert interquartile_mean(joules).value == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("drawn", [EVALUATION, TaskSet(770_000)])
def test_optima_of_drawn_tasks_are_of_todays_tasks_and_certified(drawn):
    with optima.file_of(drawn).open() as handle:
        rows = list(csv.DictReader(handle))
    found = optima.read(optima.file_of(drawn), drawn)
    # A row of another task than today's is not read.
    assert len(found) == len(rows)
    for known in optima.optimal_figures(drawn).values():
        assert known["cost"] > 0.001 * known["energy"] / 0.02
        assert known["stationarity"] <= certificate.STATIONARITY
        assert known["mesh_change"] <= certificate.REFINEMENT
        assert known["replay_error"] <= certificate.REPLAY


def test_every_shipped_policy_loads_fits_and_is_small():
    assert "ppo_elbows2_seed0" in shipped_policies()
    files = [path for folder in (baselines.BASELINES, shipped.POLICIES) for path in folder.iterdir()]
    assert sum(path.stat().st_size for path in files) <= 12_000_000
    assert {path.suffix for path in files} == {".json", ".safetensors"}
    for path in (path.with_suffix("") for path in files if path.suffix == ".json"):
        policy = read_policy(path)
        policy.check(ElbowArmEnv(**policy.card.environment))
        assert sum(part.stat().st_size for part in pair(path)) < 300_000
        assert policy.card.command.startswith(
            tuple(f"python -m agents {made}" for made in ("train", "clone", "newton"))
        )


def test_baseline_is_the_best_seed_and_no_policy_is_stored_twice():
    names = shipped_policies()
    assert len(set(names)) == len(names)
    groups = {name.rpartition("_seed")[0] for name in names}
    assert baselines.baseline_names() == sorted(groups)
    for group in groups:
        merits = [
            read_policy(shipped.shipped_path(group, k)).card.evaluation["return"] for k in shipped.shipped_seeds(group)
        ]
        assert read_policy(baselines.baseline_path(group)).card.evaluation["return"] == max(merits)


def test_shipped_two_elbow_policy_holds_its_promise():
    policy = load_policy("ppo", elbows=2)
    figures = evaluation(policy, policy.settings)
    assert figures["electrical_energy"] <= 250.0
    assert figures["steady_error_rms_mm"] <= 5.0
    for name in figures.keys() & policy.card.evaluation.keys():
        np.testing.assert_allclose(policy.card.evaluation[name], figures[name], rtol=1e-3)
    assert policy.card.training["seconds"] <= 600

"""Learning curves: when the PD was beaten, by hand; seeds on one grid; the files."""

import numpy as np
import pytest

from agents.learning.evaluation import COLUMNS
from agents.learning.run_folder import RunFolder
from benchmarks import learning
from benchmarks.learning import Curve, Goal


def curve(seed, energy, error, steps=(0, 100, 200)):
    columns = {
        "steps": np.array(steps, float),
        "training_seconds": np.array(steps, float) / 50.0,
        "wall_seconds": np.array(steps, float) / 25.0,
        "return": -np.array(energy, float),
        "electrical_energy": np.array(energy, float),
        "steady_error_rms_mm": np.array(error, float),
    }
    return Curve("ppo", "elbows2", seed, columns)


def test_pd_is_beaten_where_both_figures_are_below_its_own():
    goal = Goal(800.0, 12.0)
    assert curve(0, [900.0, 700.0, 600.0], [5.0, 13.0, 11.0]).beats(goal) == {
        "steps": 200.0,
        "training_seconds": 4.0,
        "wall_seconds": 8.0,
    }
    assert curve(0, [900.0, 900.0, 900.0], [1.0, 1.0, 1.0]).beats(goal) is None


def test_seeds_share_the_grid_of_the_shortest():
    seeds = [curve(0, [0.0, 10.0, 20.0], [0, 0, 0]), curve(1, [0.0, 30.0], [0, 0], steps=(0, 100))]
    grid, mean, low, high = learning.together(seeds, "steps")
    assert grid[-1] == 100.0
    assert (mean[-1], low[-1], high[-1]) == pytest.approx((-20.0, -30.0, -10.0))


def test_figure_and_table_come_from_the_files(tmp_path):
    results = tmp_path
    (results / "energy.csv").write_text(
        "controller,elbows,regime,electrical_energy [J],error_rms [mm],return [-]\n"
        "pd,2,A,800,400,-80\npd,2,B,50,12,-4\n"
    )
    for seed, energy in ((0, 600.0), (1, 900.0)):
        row = dict.fromkeys(COLUMNS, 1.0) | {"electrical_energy": energy, "return": -30.0 - seed}
        rows = [[row[name] if name != "steps" else steps for name in COLUMNS] for steps in (0.0, 100.0)]
        (results / "run").mkdir(exist_ok=True)
        (results / "run/run.json").write_text("{}")
        RunFolder(results / "run").write_evaluations(rows)
        (results / "curves").mkdir(exist_ok=True)
        (results / "run/evaluations.csv").rename(results / f"curves/ppo_elbows2_seed{seed}.csv")
    assert learning.save(results, results / "curves") == [("ppo", "elbows2", "2", "1", "0", "1", "1", "-30.5")]
    assert (results / "learning.png").stat().st_size > 10_000
    assert "PPO, 24 V" in (results / "learning.md").read_text()
    (results / "curves/what_seed0.csv").write_text("steps [-]\n0\n")
    with pytest.raises(ValueError, match=r"curves must be named ALGORITHM_TASK_seedK.csv, got what_seed0.csv"):
        learning.save(results, results / "curves")


def test_no_curves_make_no_figure(tmp_path):
    assert learning.save(tmp_path, tmp_path) == []
    assert not list(tmp_path.iterdir())

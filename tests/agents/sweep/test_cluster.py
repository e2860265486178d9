"""Sweeps on Ray: the same bits as in processes, and trials that ASHA stops early."""

import csv
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from agents.jobs.machines import HERE, Machines
from agents.sweep.plan import Plan
from agents.sweep.run import sweep
from elbow_gym.baselines.policy import read_policy

PLAN = Plan(
    algorithms=("ppo", "sac"),
    elbows=(2, 1),
    seeds=3,
    environment={"duration": 1.0},
    settings={
        "num_envs": 4,
        "hidden": [[8]],
        "ppo": {"total_timesteps": 1024, "n_steps": 64, "batch_size": 64, "n_epochs": 1, "evaluate_every": 256},
        "sac": {
            "total_timesteps": 800,
            "evaluate_every": 200,
            "learning_starts": 400,
            "batch_size": 32,
            "gradient_steps": 1,
            "buffer_size": 4000,
            "imitation_steps": 50,
            "critic_head_start": 20,
        },
    },
)

pytestmark = [
    pytest.mark.soak,
    pytest.mark.filterwarnings("ignore"),
    pytest.mark.skipif(find_spec("ray") is None, reason="Ray is missing"),
]


def evaluations(folder):
    """Steps and figures of each run; seconds differ."""
    found = {}
    for path in sorted(folder.glob("runs/*/evaluations.csv")):
        with path.open() as file:
            found[path.parent.name] = [row[:1] + row[3:] for row in csv.reader(file)]
    return found


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweeps") / "local"
    return folder, sweep(folder, PLAN, Machines())


def test_sweep_on_ray_has_the_bits_of_the_one_in_processes(local, tmp_path):
    folder, rows = local
    there = sweep(tmp_path / "ray", PLAN, Machines(ray=HERE))
    assert len(evaluations(folder)) == 2 * 2 * 3
    assert evaluations(tmp_path / "ray") == evaluations(folder)
    assert [row.trial for row in there] == [row.trial for row in rows]
    for run in evaluations(folder):
        weights, others = (read_policy(place / "runs" / run / "best").weights for place in (folder, tmp_path / "ray"))
        for entry in weights:
            np.testing.assert_array_equal(weights[entry], others[entry])


def test_asha_stops_those_that_are_behind_and_trains_the_others_to_the_same_bits(tmp_path):
    # A training whose steps are too small to learn anything is behind.
    settings = {**PLAN.settings, "learning_rate": [1e-3, 1e-9, 1e-8, 1e-7]}
    plan = replace(PLAN, algorithms=("ppo",), elbows=(2,), settings=settings)
    rows = sweep(tmp_path / "asha", plan, Machines(ray=HERE, workers=1), asha=True)
    assert len(rows) == 4
    assert {row.seeds for row in rows} == {3}
    done = [row.done for row in rows]
    assert sorted(done) == done[::-1]
    assert done[0] == 1.0
    assert done[-1] < 0.5
    alone = replace(plan, settings={**settings, "learning_rate": rows[0].trial.changes["learning_rate"]})
    sweep(tmp_path / "alone", alone, Machines())
    found, expected = evaluations(tmp_path / "asha"), evaluations(tmp_path / "alone")
    assert {name: found[name] for name in expected} == expected
    before = found
    again = sweep(tmp_path / "asha", None, Machines(ray=HERE, workers=1), resume=True, asha=True)
    assert evaluations(tmp_path / "asha").keys() == before.keys()
    assert again[0].figures["return"] == rows[0].figures["return"]

"""Sweeps from end to end: the table, the figure, going on after an interruption, and the best trial trained."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from agents.__main__ import app
from agents.evaluation.interquartile import center
from agents.jobs.machines import Machines
from agents.learning.callback import Keeper
from agents.sweep.plan import Plan
from agents.sweep.run import best_of, sweep
from elbow_gym.baselines.policy import read_policy
from tests.support.workers import do_jobs_here

PLAN = Plan(
    elbows=(2, 1),
    seeds=2,
    environment={"duration": 0.5},
    settings={
        "total_timesteps": 256,
        "num_envs": 4,
        "n_steps": 32,
        "batch_size": 64,
        "n_epochs": 1,
        "evaluate_every": 128,
        "hidden": [[8], [4]],
    },
)


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A sweep that was interrupted in the middle and went on, its rows, and the runs that had finished before."""
    folder = tmp_path_factory.mktemp("sweep") / "first"
    with pytest.MonkeyPatch.context() as patch:
        do_jobs_here(patch)
        on_step = Keeper._on_step

        def interrupt(keeper):
            if "elbows1" in keeper._run.name:
                raise KeyboardInterrupt
            return on_step(keeper)

        with pytest.MonkeyPatch.context() as interrupted:
            interrupted.setattr(Keeper, "_on_step", interrupt)
            with pytest.raises(KeyboardInterrupt):
                sweep(folder, PLAN, Machines(workers=2))
        before = {path.parent.name: path.read_bytes() for path in folder.glob("runs/*elbows2*/result.json")}
        return folder, sweep(folder, None, Machines(workers=2), resume=True), before


@pytest.mark.slow
def test_trial_has_the_interquartile_means_over_its_seeds(swept):
    folder, rows, _ = swept
    assert [(row.seeds, row.done) for row in rows] == [(2, 1.0)] * 4
    for row in rows:
        cards = [read_policy(folder / "runs" / f"{row.trial.name}_seed{k}" / "best").card.evaluation for k in (0, 1)]
        for name, estimate in row.figures.items():
            if name != "hours":
                assert estimate.value == center([card[name] for card in cards])
                assert estimate.low <= estimate.value <= estimate.high
    with (folder / "sweep.csv").open() as file:
        written = list(csv.DictReader(file))
    assert [float(line["return"]) for line in written] == [float(f"{row.merit:.6g}") for row in rows]
    assert (folder / "sweep.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_best_trial_is_that_with_the_best_return_of_its_task_alone(swept):
    folder, rows, _ = swept
    assert [row.trial.task.name for row in rows] == ["elbows2", "elbows2", "elbows1", "elbows1"]
    assert [row.best for row in rows] == [True, False, True, False]
    assert rows[0].merit >= rows[1].merit
    assert rows[2].merit >= rows[3].merit
    table = (folder / "sweep.md").read_text()
    assert table.count("**") == 4
    # What is the same in all is not repeated in each.
    assert "hidden 8" in table
    assert "batch_size" not in table
    assert [trial.name for trial in best_of(folder)] == [rows[0].trial.name, rows[2].trial.name]


@pytest.mark.slow
def test_sweep_goes_on_where_it_was_interrupted_and_is_not_overwritten(swept):
    folder, _, before = swept
    assert len(before) == 4
    assert {name: (folder / "runs" / name / "result.json").read_bytes() for name in before} == before
    with pytest.raises(ValueError, match="output must be free of earlier sweeps, or --resume be given, got"):
        sweep(folder, PLAN, Machines())
    with pytest.raises(ValueError, match=r"plan of a resumed sweep must be that in .*sweep\.json, got another"):
        sweep(folder, replace(PLAN, seeds=3), Machines(), resume=True)


@pytest.mark.slow
def test_best_settings_are_trained_and_published_by_one_command(swept, tmp_path, monkeypatch, capsys):
    folder, rows, _ = swept
    do_jobs_here(monkeypatch)
    published = []
    monkeypatch.setattr(
        "agents.learning.publish.publish", lambda runs, allow_worse: published.extend(runs) or ["published"]
    )
    app.run(["best", str(folder), "--seeds", "1", "--label", "swept", "--output", str(tmp_path), "--publish"])
    names = ["ppo_swept_elbows2_seed0", "ppo_swept_elbows1_seed0"]
    assert published == [tmp_path / name for name in names]
    # The same seed with the same settings is the same training, where none was interrupted.
    before = read_policy(folder / "runs" / f"{rows[0].trial.name}_seed0" / "best")
    again = read_policy(tmp_path / names[0] / "best")
    for entry, weights in again.weights.items():
        np.testing.assert_array_equal(weights, before.weights[entry])
    said = capsys.readouterr().out.splitlines()
    assert said[0] == again.card.command
    assert said[-1] == "published"


def test_folder_without_a_finished_trial_has_no_best(tmp_path):
    (tmp_path / "sweep.json").write_text(json.dumps(PLAN.to_dict()))
    with pytest.raises(ValueError, match="a sweep must have a finished trial of each task, got none of"):
        best_of(tmp_path)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--file plan.json --seeds 2", "--file must be given without the options of a plan, got plan.json"),
        ("--algorithms dpo", "algorithms must be among ppo, sac, got dpo"),
        ("--seeds 0", "--seeds must be a positive integer, got 0"),
    ],
)
def test_command_refuses_in_one_line(tmp_path, words, message, capsys):
    with pytest.raises(SystemExit) as end:
        app.run(["sweep", str(tmp_path / "sweep"), *words.split()])
    assert message in f"{end.value.code}{capsys.readouterr().err}"
    assert not (tmp_path / "sweep").exists()

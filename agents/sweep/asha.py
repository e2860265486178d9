"""Sweep on Ray Tune: trials train in rungs, and ASHA lets the best third of those that reach one go on.

A trial is one process, which trains its seeds in turn up to a rung and reports the interquartile mean of their returns.
Trials of other tasks are no rivals, so that each task is a search of its own. What is trained is in the runs' folders:
a trial whose worker dies goes on from there, and a sweep that is resumed replays the rungs that are done.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ray import tune
from ray.tune.schedulers import ASHAScheduler

from agents.evaluation.interquartile import center
from agents.files import check_writable
from agents.jobs.bar import Bar, say
from agents.jobs.cluster import connection
from agents.jobs.machines import HERE, Machines
from agents.learning.run import Run
from agents.learning.train import batches, compilations, train
from agents.sweep.results import Trials
from agents.workers import compile_before, cores

RUNGS = (1, 3, 9)
"""Ninths of the training after which trials are compared."""
FACTOR = 3
"""One of so many trials goes on from a rung."""


def run_trials(trials: Trials, folder: Path, machines: Machines, resume: bool) -> None:
    """Trains the trials, those that are behind only in part.

    Args:
        trials: trials and their runs by the trials' names.
        folder: the sweep's; Tune writes to "tune" in it.
        machines: a cluster of Ray; one started here when it has none.
        resume: whether runs in the folders go on.

    Raises:
        ValueError: a run's folder is not free and `resume` is not set.
        ChildProcessError: trials failed, which are named.
    """
    runs = [run for _, group in trials.values() for run in group]
    for run in runs:
        run.files.check(run.record(), resume)
    for run in runs:
        check_writable(run.folder)
    compile_before(batches(runs), compilations(runs))
    os.environ["TUNE_DISABLE_SIGINT_HANDLER"] = "1"
    tasks: dict[Any, list[Sequence[Run]]] = {}
    for trial, group in trials.values():
        tasks.setdefault(trial.question, []).append(group)
    failed: list[str] = []
    with connection(machines.ray or HERE, machines.workers or cores()), Bar(RUNGS[-1] * len(trials), "ninth") as bar:
        for groups in tasks.values():
            failed += _search(groups, folder, machines, bar)
    if failed:
        raise ChildProcessError("; ".join(failed))


def _search(groups: list[Sequence[Run]], folder: Path, machines: Machines, bar: Bar) -> list[str]:
    """Trains the trials of a task, and returns what is to be said of those that failed."""
    settings = tune.TuneConfig(
        metric="return",
        mode="max",
        scheduler=ASHAScheduler(time_attr="ninths", max_t=RUNGS[-1], grace_period=RUNGS[0], reduction_factor=FACTOR),
    )
    run_settings = tune.RunConfig(
        name="tune",
        storage_path=str(folder.absolute()),
        failure_config=tune.FailureConfig(max_failures=machines.retries),
        verbose=0,
        callbacks=[_Progress(groups, bar)],
    )
    tuner = tune.Tuner(
        tune.with_resources(tune.with_parameters(_train_in_rungs, groups=groups), {"cpu": machines.cpus}),
        param_space={"number": tune.grid_search(list(range(len(groups))))},
        tune_config=settings,
        run_config=run_settings,
    )
    return [str(error) for error in tuner.fit().errors]


def _train_in_rungs(config: dict[str, Any], groups: list[Sequence[Run]]) -> None:
    """Trains the runs of a trial in turn, rung after rung, and reports the interquartile mean of their returns."""
    runs = groups[config["number"]]
    for rung in RUNGS:
        best = []
        for run in runs:
            until = None if rung == RUNGS[-1] else rung * run.settings.total_timesteps // RUNGS[-1]
            best.append(train(run, resume=True, until=until)["best"]["return"])
        tune.report({"return": center(best), "ninths": rung})


class _Progress(tune.Callback):
    """Shows how far the trials are, and which of them end."""

    def __init__(self, groups: list[Sequence[Run]], bar: Bar) -> None:
        self._groups, self._bar = groups, bar
        self._done = dict.fromkeys(range(len(groups)), 0)

    def on_trial_result(self, iteration: int, trials: list[Any], trial: Any, result: dict[str, Any], **_: Any) -> None:
        """Tells of a rung that a trial has reached."""
        number, rung = trial.config["number"], result["ninths"]
        name = self._groups[number][0].name.rpartition("_seed")[0]
        if rung > self._done[number]:
            self._bar(rung - self._done[number])
            self._done[number] = rung
        say(f"{name}: {rung}/{RUNGS[-1]} of the training, return {result['return']:.2f}")

    def on_trial_complete(self, iteration: int, trials: list[Any], trial: Any, **_: Any) -> None:
        """Counts what a trial that ends early is spared."""
        number = trial.config["number"]
        self._bar(RUNGS[-1] - self._done[number])
        self._done[number] = RUNGS[-1]

"""Trainings that are made round by round: several seeds side by side, their evaluations, best policies and results."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from agents.files import check_writable
from agents.jobs.job import Job, Tell
from agents.jobs.machines import Machines, do_all
from agents.learning.evaluation import evaluation, evaluation_row, evaluation_seeds
from agents.learning.run_folder import RunFolder
from agents.workers import compile_before
from elbow_gym.baselines.policy import Policy
from elbow_gym.task.settings import Settings


@dataclass(frozen=True, kw_only=True)
class RoundsRun:
    """One seed of a training by rounds."""

    folder: Path
    """Folder of the run's files."""
    record: dict[str, Any]
    """Everything that tells the run from others, JSON types only, its seed among them."""
    work: Callable[[RoundsRun, Tell], dict[str, Any]]
    """What trains: a picklable function that tells the rounds and returns the result."""
    rounds: int
    """Number of rounds."""


def train_by_rounds(
    runs: Mapping[int, RoundsRun],
    settings: Settings,
    what: str,
    stopped: str,
    resume: bool = False,
    machines: Machines | None = None,
    others: Mapping[Callable[[], Any], int] | None = None,
) -> dict[int, dict[str, Any]]:
    """Trains several seeds side by side, in processes unless machines are given; the results by seed.

    Each folder gets the files of a `RunFolder`. With `resume` the seeds that are finished are left alone.

    Args:
        runs: the runs by seed.
        settings: the environment, whose kernel is compiled before.
        what: word for the progress bar.
        stopped: what a line says of a run that Ctrl-C has stopped.
        resume: whether runs that are there go on.
        machines: where they are trained.
        others: calls that compile what else the seeds need, and about how long each takes [s].

    Raises:
        ValueError: a folder holds a run already and `resume` is not set or it had other settings.
    """
    from tqdm import tqdm

    results: dict[int, dict[str, Any]] = {}
    jobs: dict[int, Job[dict[str, Any]]] = {}
    for seed, run in runs.items():
        files = RunFolder(run.folder)
        files.check(run.record, resume)
        finished = files.result()
        if finished is not None:
            results[seed] = finished
        else:
            jobs[seed] = Job(partial(run.work, run), run.rounds, run.folder.name, run.folder)
    if jobs:
        for seed in jobs:
            check_writable(runs[seed].folder)
        compile_before([settings], others)
        try:
            with tqdm(total=sum(job.size for job in jobs.values()), unit="round", desc=what) as bar:
                results.update(do_all(jobs, bar.update, machines))
        except KeyboardInterrupt:
            for run in runs.values():
                finished = RunFolder(run.folder).result() is not None
                print(f"{run.folder.name}: {'finished' if finished else stopped}", flush=True)
            raise
    return {seed: results[seed] for seed in runs}


class Judge:
    """Evaluates the policies of a run and keeps the one with the best return; its clock stands still meanwhile.

    Args:
        files: the run's folder.
        settings: settings of the environment.
        resume: whether the folder's earlier evaluations and best policy count.
    """

    def __init__(self, files: RunFolder, settings: Settings, resume: bool = False) -> None:
        self._files, self._settings = files, settings
        self._rows, self._best = (files.evaluations(), files.best()) if resume else ([], None)
        self._spent, self._before = (self._rows[-1][1], self._rows[-1][2]) if self._rows else (0.0, 0.0)
        self._started = self._since = time.monotonic()

    def __call__(self, steps: int, policy: Policy) -> None:
        """Evaluates a policy after so many control periods, summed over all arms, and keeps it if it is the best."""
        self._spent += time.monotonic() - self._since
        figures = evaluation(policy, self._settings)
        self._rows.append(evaluation_row(steps, self._spent, self._wall, figures))
        self._files.write_evaluations(self._rows)
        if self._best is None or figures["return"] > self._best.card.evaluation["return"]:
            policy.card.training.update(timesteps=steps, seconds=round(self._spent, 1))
            policy.card.evaluation.update(figures, seeds=list(evaluation_seeds(self._settings)))
            self._files.write_best(policy)
            self._best = policy
        self._since = time.monotonic()

    @property
    def _wall(self) -> float:
        return self._before + time.monotonic() - self._started

    def finish(self, seed: int) -> dict[str, Any]:
        """Writes the result of the run and returns it. Raises RuntimeError before the first evaluation."""
        if self._best is None:
            raise RuntimeError("no policy was evaluated yet")
        result = {
            "name": self._files.path.name,
            "seed": seed,
            "steps": int(self._rows[-1][0]),
            "finished": True,
            "training_seconds": round(self._spent, 1),
            "wall_seconds": round(self._wall, 1),
            "best": self._best.card.evaluation,
        }
        self._files.write_result(result)
        return result

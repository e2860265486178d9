"""Run of a sweep: all trainings side by side, or those that ASHA lets go on, and the results of both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from agents.files import check_writable, write_json
from agents.jobs.machines import Machines
from agents.learning.train import train_all
from agents.sweep.plan import FILE, Plan, Trial
from agents.sweep.results import Row, Trials, markdown, rows_of, save

PLACE = "runs"
"""Folder of the runs in that of a sweep."""


def sweep(folder: Path, plan: Plan | None, machines: Machines, resume: bool = False, asha: bool = False) -> list[Row]:
    """Trains all trials' seeds, writes the results, prints the table, and returns the rows.

    Args:
        folder: what all is written to: the plan, a folder for each run, a table and a figure.
        plan: what is compared; that of the folder when None.
        machines: where the runs are trained.
        resume: go on with the sweep in the folder.
        asha: whether trials that are behind others of their task stop early, on Ray Tune.

    Raises:
        ValueError: the folder holds a sweep and `resume` is not set, or another one; or something in the plan is
            refused.
        OSError: the folder cannot be written.
        KeyboardInterrupt: it was interrupted.
    """
    plan = _opened(folder, plan, resume)
    trials = plan.runs(folder / PLACE)
    if asha:
        from agents.sweep.asha import run_trials

        run_trials(trials, folder, machines, resume)
    else:
        train_all([run for _, runs in trials.values() for run in runs], machines, resume)
    return report(folder, trials)


def report(folder: Path, trials: Trials) -> list[Row]:
    """Writes the results of a sweep's runs as they are now, prints the table, and returns the rows."""
    rows = rows_of(trials)
    written = save(rows, folder)
    print(markdown(rows), *written, sep="\n")
    return rows


def best_of(folder: Path) -> list[Trial]:
    """The best trial of each task of a sweep. Raises ValueError where one has none that is trained to the end."""
    rows = rows_of(Plan.read(folder / FILE).runs(folder / PLACE))
    best = [one.trial for one in rows if one.best]
    for question in dict.fromkeys(one.trial.question for one in rows):
        if question not in [trial.question for trial in best]:
            raise ValueError(f"a sweep must have a finished trial of each task, got none of {question} in {folder}")
    return best


def _opened(folder: Path, plan: Plan | None, resume: bool) -> Plan:
    """The plan, which is in the folder then."""
    path = folder / FILE
    if path.is_file():
        if not resume:
            raise ValueError(f"output must be free of earlier sweeps, or --resume be given, got {folder}")
        before = Plan.read(path)
        # A checkpoint may come more often than before.
        if plan is not None and replace(plan, checkpoint_seconds=before.checkpoint_seconds) != before:
            raise ValueError(f"plan of a resumed sweep must be that in {path}, got another")
        return before
    if plan is None:
        raise ValueError(f"plan must be given for a new sweep, got no {path}")
    plan.runs(folder / PLACE)
    check_writable(folder)
    write_json(path, plan.to_dict())
    return plan

"""Commands of sweeps: `python -m agents sweep` and `python -m agents best`."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional, arg

from agents.jobs.machines import HERE, Machines
from agents.learning.command import Schedule
from agents.sweep.plan import Plan

PLAN, MACHINES, RUNS = Plan(), Machines(), Schedule(seeds=5)
Folder = Annotated[Path, Positional, arg(metavar="FOLDER")]


def sweep_command(words: Sequence[str]) -> Callable[..., None]:
    """The command `sweep`."""
    del words

    def sweep(
        output: Folder,
        /,
        plan: OmitArgPrefixes[Plan] = PLAN,
        file: Path | None = None,
        resume: bool = False,
        asha: bool = False,
        machines: OmitArgPrefixes[Machines] = MACHINES,
    ) -> None:
        """Compares algorithms, elbows, settings and arguments of the environment over seeds: a table and a figure.

        A trial is scored by the interquartile mean over its seeds, never by one. `python -m agents best FOLDER` trains
        the best ones.

        Args:
            output: Folder of the sweep: its plan, a folder for each run, sweep.md, sweep.csv and sweep.png.
            plan: Plan.
            file: JSON file of a plan, with the names of its options, in place of them.
            resume: Whether the sweep in the folder goes on; finished runs are left alone.
            asha: Whether trials that are behind others of their task stop early, on Ray Tune: a third of them goes on
                from a ninth and from a third of the training.
            machines: Machines.
        """
        from agents.sweep.run import sweep as run_sweep

        given = None if plan == PLAN and (resume or file is not None) else plan
        if file is not None:
            if given is not None:
                raise ValueError(f"--file must be given without the options of a plan, got {file}")
            given = Plan.read(file)
        on = replace(machines, ray=HERE) if asha and machines.ray is None else machines
        run_sweep(on.place(output), given, on, resume, asha)

    return sweep


def best_command(words: Sequence[str]) -> Callable[..., None]:
    """The command `best`."""
    del words

    def best(
        sweep: Folder,
        /,
        run: OmitArgPrefixes[Schedule] = RUNS,
        publish: bool = False,
        allow_worse: bool = False,
        machines: OmitArgPrefixes[Machines] = MACHINES,
    ) -> None:
        """Trains the best trial of each task of a sweep, and publishes it if asked for.

        Args:
            sweep: Folder of the sweep.
            run: Runs.
            publish: Whether the runs are taken over into the shipped policies, as `python -m agents publish` does.
            allow_worse: Whether a shipped policy may give way to one with a worse return.
            machines: Machines.
        """
        from agents.learning.publish import publish as publish_runs
        from agents.learning.train import train_all
        from agents.sweep.run import best_of

        schedule = replace(run, output=machines.place(run.output))
        trials = best_of(machines.place(sweep))
        runs = [one for trial in trials for one in trial.runs(schedule)]
        for trial in trials:
            print(shlex.join(trial.command(schedule)), flush=True)
        train_all(runs, machines, schedule.resume)
        if publish:
            for name in publish_runs([one.folder for one in runs], allow_worse=allow_worse):
                print(name)

    return best

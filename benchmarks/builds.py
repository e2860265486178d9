"""Time that PPO takes until the PD is beaten, in two builds of this project, and where it goes."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from agents.files import write_csv, write_text
from agents.style import ELBOW_NAMES
from benchmarks.learning import Goal, goals
from benchmarks.machine import RESULTS

SCRIPT = Path(__file__).with_name("race.py")
NEVER = Goal(0.0, 0.0)
"""Goal of a training that is not to end early."""
PARTS = ("arms", "rollout", "update", "evaluation", "checkpoint")
"""Parts of a training; the rollout is without its arms, and the training's seconds are those of the first three."""
HEADER = (
    *("build", "elbows", "seed", "arms [-]", "steps [-]", "training [s]"),
    *(f"{part} [s]" for part in PARTS),
    "beaten [-]",
    "return [-]",
)
"""Columns of the CSV: seconds are CPU time; `beaten` is 1 where the training ended because the PD was beaten."""
FULL_ARMS, FULL_STEPS = 256, 262_144
"""Arms and control periods of the trainings that measure the speed alone."""


def race(build: str, checkout: Path, python: Path, elbows: int, seed: int, goal: Goal, **settings: Any) -> list[Any]:
    """Row of `HEADER` of one training, in a process on one core.

    Args:
        build: name of the build in the table.
        checkout: folder of the build's checkout.
        python: interpreter with the build's libraries.
        elbows: number of elbows on the table.
        seed: seed of the training.
        goal: energy and error that end the training once it is below both.
        settings: fields of `PPOSettings` in place of the task's.

    Raises:
        ChildProcessError: the training failed.
    """
    one_core = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    words = [str(python), str(SCRIPT), str(elbows), str(seed), json.dumps(settings), str(goal.energy), str(goal.error)]
    ran = subprocess.run(
        words,
        cwd=checkout,
        env={**os.environ, **one_core, "PYTHONPATH": str(checkout)},
        capture_output=True,
        text=True,
        check=False,
    )
    if ran.returncode:
        raise ChildProcessError(f"training in {checkout} failed: {ran.stderr.strip().splitlines()[-1:]}")
    found = json.loads(ran.stdout.splitlines()[-1])
    seconds = [f"{found[f'{part}_seconds']:.4g}" for part in ("training", *PARTS)]
    beaten = int(bool(found["beaten_after"]))
    arms = found["arms"]
    return [build, elbows, seed, arms, found["steps"], *seconds, beaten, f"{found['best_return']:.5g}"]


def measure(checkout: Path, python: Path | None, seeds: int, output: Path = RESULTS) -> None:
    """Trains in both builds in turn, at every elbow count and at `FULL_ARMS`, and writes builds.csv.

    A training that fails is named and has no row.

    Args:
        checkout: folder of the other build's checkout.
        python: interpreter with the other build's libraries; this one when None.
        seeds: number of training seeds.
        output: folder of the results, with the PD's metrics in energy.csv.
    """
    own = Path(sys.executable)
    builds = {"before": (checkout.resolve(), python or own), "now": (SCRIPT.parents[1], own)}
    known, rows = goals(output), []

    def add(build: str, elbows: int, seed: int, goal: Goal, **settings: Any) -> None:
        try:
            rows.append(race(build, *builds[build], elbows, seed, goal, **settings))
        except ChildProcessError as error:
            # An old build may fail where this one does not; the others are worth having.
            print(f"{build}, {ELBOW_NAMES[elbows]}, seed {seed}: {error}", file=sys.stderr)
        write_csv(output / "builds.csv", HEADER, rows)

    for seed in range(seeds):
        for elbows in ELBOW_NAMES:
            for build in builds:
                add(build, elbows, seed, known[f"elbows{elbows}"])
        for build in builds:
            add(build, 2, seed, NEVER, num_envs=FULL_ARMS, total_timesteps=FULL_STEPS)


def table(rows: Sequence[dict[str, str]]) -> list[tuple[str, ...]]:
    """Medians over the seeds of each build, elbow count and number of arms, with the header first.

    Args:
        rows: those of builds.csv, by the names in `HEADER`.
    """
    shown = ("arms", "rollout", "update", "evaluation")
    lines = [
        (
            *("task", "arms", "build", "seeds", "beat the PD", "steps", "training seconds", "control periods a second"),
            *(f"{part} (us)" for part in shown),
        )
    ]
    for arms, elbows, build in dict.fromkeys((row["arms [-]"], row["elbows"], row["build"]) for row in rows):
        chosen = [row for row in rows if (row["arms [-]"], row["elbows"], row["build"]) == (arms, elbows, build)]
        steps, training = _column(chosen, "steps [-]"), _column(chosen, "training [s]")
        each = [np.median(1e6 * _column(chosen, f"{part} [s]") / steps) for part in shown]
        beaten = int(_column(chosen, "beaten [-]").sum())
        lines.append(
            (
                ELBOW_NAMES[int(elbows)],
                arms,
                build,
                f"{len(chosen)}",
                f"{beaten}" if beaten else "-",
                f"{np.median(steps):.3g}",
                f"{np.median(training):.3g}",
                f"{np.median(steps / training):.3g}",
                *(f"{one:.3g}" for one in each),
            )
        )
    return lines


def _column(rows: Sequence[dict[str, str]], name: str) -> Any:
    return np.array([float(row[name]) for row in rows])


def save(results: Path = RESULTS) -> list[tuple[str, ...]]:
    """Writes builds.md from builds.csv in `results`, and returns its rows; none without that file."""
    path = results / "builds.csv"
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as handle:
        lines = table(list(csv.DictReader(handle)))
    lines.insert(1, ("---",) * len(lines[0]))
    write_text(results / "builds.md", "".join(f"| {' | '.join(line)} |\n" for line in lines))
    return [line for line in lines if line[0] != "---"]

"""Optima of the evaluation tasks: a row of a CSV for each, with its certificate or the reason why there is none."""

from __future__ import annotations

import csv
import hashlib
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from agents.files import check_writable, write_csv
from agents.jobs.machines import Machines
from agents.optimal.batch import bounds
from agents.optimal.certificate import Bound
from agents.optimal.store import Store
from agents.tasks import settings_of_task
from benchmarks.machine import RESULTS
from benchmarks.tasks.task_set import EVALUATION, TaskSet

SOLVED = "solved"
"""Status of a task whose optimum is known; that of others is the reason why it is not."""
UNITS = {
    "cost": "-",
    "energy": "J",
    "error_rms": "mm",
    "stationarity": "-",
    "violation": "-",
    "mesh_change": "-",
    "replay_error": "-",
    "cpu_seconds": "s",
}
"""Figures of an optimum and their units: energy of the whole episode, error from 2 s on, and the certificate."""
HEADER = ("elbows", "task", "digest", "status", "starts", *(f"{name} [{unit}]" for name, unit in UNITS.items()))
DIGITS = 9
"""Significant digits of the numbers in a digest: the last ones depend on the processor."""

Key = tuple[int, int]
"""Number of elbows, and number of the task."""


@dataclass(frozen=True)
class Solved:
    """What is known of the optimum of a task."""

    digest: str
    status: str
    starts: int
    """Number of postures that the solution was sought from, the larger one of several runs."""
    figures: Mapping[str, float] = field(default_factory=dict[str, float])
    """Figures by the names of `UNITS`; none where the task is not solved."""


def digest_of(elbows: int, task: Mapping[str, Any]) -> str:
    """Digest of a task's reset options, to `DIGITS` digits of its numbers, and of its elbow count."""

    def rounded(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {name: rounded(entry) for name, entry in value.items()}
        if isinstance(value, list):
            return [rounded(entry) for entry in value]
        return f"{value:.{DIGITS}g}" if isinstance(value, float) else value

    text = json.dumps({"elbows": elbows, **rounded(task)}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def file_of(drawn: TaskSet, folder: Path = RESULTS) -> Path:
    """File of a set's optima in a folder."""
    return folder / f"{drawn.name}_optima.csv"


def read(path: Path, drawn: TaskSet = EVALUATION) -> dict[Key, Solved]:
    """The rows of a file, without those of other tasks than the set's; none where there is no file."""
    if not path.is_file():
        return {}
    found = {}
    with path.open(newline="", encoding="utf-8") as handle:
        for row in csv.DictReader(handle):
            key = int(row["elbows"]), int(row["task"])
            values = {name: row[f"{name} [{unit}]"] for name, unit in UNITS.items()}
            figures = {name: float(value) for name, value in values.items() if value}
            task = drawn.numbered(key[0]).get(key[1])
            if task is not None and row["digest"] == digest_of(key[0], task):
                found[key] = Solved(row["digest"], row["status"], int(row["starts"]), figures)
    return found


def optimal_figures(drawn: TaskSet = EVALUATION, path: Path | None = None) -> dict[Key, Mapping[str, float]]:
    """Figures of the solved tasks of a set, from its own file when no other is given."""
    known = read(file_of(drawn) if path is None else path, drawn)
    return {key: one.figures for key, one in known.items() if one.status == SOLVED}


def solve(
    counts: Sequence[int], starts: int, machines: Machines, drawn: TaskSet = EVALUATION, path: Path | None = None
) -> str:
    """Solves the tasks of a set that the file has no optimum of, and writes each as it is found.

    Those that were solved from fewer starts are solved again; the cheaper solution stays.

    Args:
        counts: elbow counts, one after the other.
        starts: number of postures, as in `agents.optimal.bound`.
        machines: what solves them; their storage, where they have one, holds the store.
        drawn: the set.
        path: file of the optima; the set's own when None.

    Returns:
        How many are solved, and the reasons of those that failed.

    Raises:
        ValueError: CasADi is not installed.
    """
    from tqdm import tqdm

    if find_spec("casadi") is None:
        raise ValueError('casadi must be installed to solve, got none: pip install -e ".[optimal]"')
    path = file_of(drawn) if path is None else path
    check_writable(path.parent)
    found = read(path, drawn)
    asked = [(elbows, number) for elbows in counts for number in drawn.numbered(elbows)]
    todo = [key for key in asked if not _is_solved(found, key) or found[key].starts < starts]
    options = {key: drawn.numbered(key[0])[key[1]] for key in todo}

    def keep(k: int, answer: Bound | str) -> None:
        key = todo[k]
        new = solved(digest_of(key[0], options[key]), starts, answer)
        if _is_solved(found, key):
            old = found[key].figures
            better = new.status == SOLVED and new.figures["cost"] < old["cost"]
            new = new if better else replace(found[key], starts=starts)
        found[key] = new
        write(path, found)
        bar.update()

    store = None if machines.storage is None else Store(machines.place(Path("bounds")))
    with tqdm(total=len(todo), unit="task", file=sys.stderr) as bar:
        if todo:
            settings = [settings_of_task(elbows, options[elbows, number]) for elbows, number in todo]
            # Otherwise the store would answer with what is to be improved.
            fresh = any(_is_solved(found, key) for key in todo)
            bounds(settings, fresh=fresh, starts=starts, machines=machines, progress=keep, store=store)
    failed = [
        f"task {number} with elbows {elbows} failed: {found[elbows, number].status}"
        for elbows, number in asked
        if not _is_solved(found, (elbows, number))
    ]
    return "\n".join([*failed, f"{len(asked) - len(failed)} of {len(asked)} tasks solved: {path}"])


def _is_solved(found: Mapping[Key, Solved], key: Key) -> bool:
    return key in found and found[key].status == SOLVED


def solved(digest: str, starts: int, answer: Bound | str) -> Solved:
    """What a solve tells of a task: an optimum, or the reason why there is none."""
    if isinstance(answer, str):
        return Solved(digest, answer, starts)
    every = {**answer.figures, "cost": answer.cost}
    return Solved(digest, SOLVED, starts, {name: float(every[name]) for name in UNITS})


def write(path: Path, found: Mapping[Key, Solved]) -> None:
    """Writes the file whole, most elbows first."""
    rows = [
        [
            *key,
            one.digest,
            one.status,
            one.starts,
            *(f"{one.figures[name]:.6g}" if one.figures else "" for name in UNITS),
        ]
        for key, one in sorted(found.items(), key=lambda item: (-item[0][0], item[0][1]))
    ]
    write_csv(path, HEADER, rows)

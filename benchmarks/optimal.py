"""Bound on the return for each elbow count, also without the table, and the front around it."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from agents.control.trajectory import Trajectory
from agents.files import check_writable, read_json, write_csv, write_text
from agents.jobs.job import Job, Tell
from agents.jobs.machines import Machines
from agents.machine import machine, versions
from agents.optimal.certificate import Optimum
from agents.optimal.guesses import posture_guesses
from agents.optimal.problem import Problem
from agents.optimal.search import certified
from agents.optimal.solution import SolveError
from agents.shipped import OPTIMA
from agents.workers import compile_before
from elbow_gym.task.settings import Settings

DEFAULT_WEIGHT = 0.001
FRONT_WEIGHTS = (0.0002, 0.002, 0.005)
"""Energy weights of the front beside the default one [1/W]."""
ELBOW_COUNTS = (2, 0, 1)
MAKER = "python -m benchmarks optimal"

ASIDE = ("timestep", "integrator", "start_spread", "task_observation")
"""Arguments of an environment that its program does not know: it has a mesh and a start of its own, and observes
nothing."""


@dataclass(frozen=True)
class Cell:
    """Problem of the benchmark."""

    elbows: int
    start: str = "paper"
    energy_weight: float = DEFAULT_WEIGHT
    under: bool = False
    """Whether joints may go under the table with fewer than two elbows, as the environment lets them."""

    @property
    def name(self) -> str:
        """Name of the problem's files."""
        target = "_on_target" if self.start == "on_target" else ""
        weight = f"_weight{self.energy_weight:g}" if self.energy_weight != DEFAULT_WEIGHT else ""
        under = "_under" if self.under else ""
        return f"elbows{self.elbows}{target}{weight}{under}"

    @property
    def problem(self) -> Problem:
        """The default environment from a start without noise; with fewer than two elbows no joint under the table.

        With two elbows the arm lies on the table anyway; with fewer, the space under it is worth nothing to a user. The
        problems with `under` tell what it is worth to the reward.
        """
        settings = Settings(elbows=self.elbows, start=self.start, energy_weight=self.energy_weight, start_noise=0.0)
        return Problem(settings, above_table=self.elbows < 2 and not self.under)

    @property
    def parent(self) -> Cell | None:
        """Problem whose solution this one starts from, or None."""
        return Cell(self.elbows, self.start) if self.under or self.energy_weight != DEFAULT_WEIGHT else None

    @property
    def question(self) -> dict[str, Any]:
        """Question in JSON types; a stored result is used only where its question is the same."""
        problem = self.problem
        asked = {name: value for name, value in problem.settings.arguments.items() if name not in ASIDE}
        return json.loads(json.dumps({**asked, "above_table": problem.above_table}))


def cells(front: bool = True) -> list[Cell]:
    """The default reward from both starts; from its solutions the same without the table, and the front."""
    bounds = [Cell(elbows, start) for start in ("paper", "on_target") for elbows in ELBOW_COUNTS]
    bounds += [Cell(elbows, under=True) for elbows in ELBOW_COUNTS if Cell(elbows).problem.above_table]
    return bounds + [Cell(elbows, "paper", weight) for weight in FRONT_WEIGHTS for elbows in ELBOW_COUNTS if front]


def files(cell: Cell, optima: Path = OPTIMA) -> tuple[Path, Path]:
    """Files of a problem: its metrics (JSON) and its trajectory (npz)."""
    return optima / f"{cell.name}.json", optima / f"{cell.name}.npz"


def cached(cell: Cell, optima: Path = OPTIMA) -> dict[str, Any] | None:
    """Metrics of an earlier run of the same problem, or None."""
    card, trajectory = files(cell, optima)
    if not (card.is_file() and trajectory.is_file()):
        return None
    plain = read_json(card)
    return plain["figures"] if plain["problem"] == cell.question else None


def solve_cell(cell: Cell, optima: Path, tell: Tell) -> str:
    """Solves a cell and writes its files. Returns what went wrong, or ""."""

    def say(line: str) -> None:
        tell(0, f"  {cell.name}: {line}")

    parent = None if cell.parent is None else files(cell.parent, optima)[1]
    try:
        guesses = {}
        if parent is not None and parent.is_file():
            guesses["above the table" if cell.under else "default weight"] = Trajectory.load(parent)
        if cell.under or not guesses:
            guesses |= posture_guesses(cell.problem)
        # The front's cells have the default's mesh, which was refined there.
        found, _ = certified(cell.problem, guesses, say, refine=cell.energy_weight == DEFAULT_WEIGHT)
    except (SolveError, ValueError, ArithmeticError) as error:
        return str(error)
    save(cell, found.optimum, optima)
    return ""


def save(cell: Cell, found: Optimum, optima: Path) -> None:
    """Writes a cell's two files; the card last, so that a cell counts as done only when both are there."""
    card, trajectory = files(cell, optima)
    found.trajectory.save(trajectory)
    plain = {
        "problem": cell.question,
        "figures": found.figures,
        "command": MAKER,
        "made": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "machine": machine(),
        "versions": versions("elbow-gym", "numpy", "scipy", "casadi"),
    }
    write_text(card, json.dumps(plain, indent=2) + "\n")


def write_summary(results: Path, optima: Path, failures: dict[str, str]) -> None:
    """Writes optimal.csv: one row a cell; a failed one has its reason and no numbers."""
    names = [name for name in Optimum.__dataclass_fields__ if name != "trajectory"]
    rows = []
    for cell in cells():
        figures = cached(cell, optima)
        status = "solved" if figures else failures.get(cell.name, "not run")
        values = [figures[name] if figures else "" for name in names]
        values = [f"{value:.6g}" if isinstance(value, float) else value for value in values]
        key = [cell.elbows, cell.start, cell.energy_weight, cell.problem.above_table, cell.under]
        rows.append([*key, status, *values])
    header = ["elbows", "start", "energy_weight", "above_table", "under", "status", *names]
    write_csv(results / "optimal.csv", header, rows)


def run_cells(todo: Sequence[Cell], optima: Path, machines: Machines) -> dict[str, str]:
    """Solves cells side by side, with a bar; returns the failures' reasons by name."""
    from tqdm import tqdm

    failures: dict[str, str] = {}
    if todo:
        # A solution is played by one arm; the LQR around it finds its gains with a batch.
        compile_before([(Settings(), 1), Settings()])

    def submit(cell: Cell) -> None:
        pool.submit(cell, Job(partial(solve_cell, cell, optima), 1, cell.name, optima))

    with tqdm(total=len(todo), file=sys.stderr, unit="cell") as bar, machines.pool(len(todo)) as pool:
        # The front and what may go under the table start from the bound of their elbow count, so they wait for that.
        waiting = [cell for cell in todo if cell.parent in todo]
        for cell in todo:
            if cell not in waiting:
                submit(cell)
        for cell, reason in pool.outcomes(lambda _: None):
            if isinstance(reason, Exception):
                raise reason
            if reason:
                failures[cell.name] = reason
            bar.update()
            bar.set_description(cell.name)
            for one in waiting:
                if one.parent == cell:
                    submit(one)
    return failures


def optimal(output: Path, optima: Path, fresh: bool, machines: Machines, front: bool) -> None:
    """Solves what is not there yet, writes optimal.csv and says what failed.

    Args:
        output: folder for optimal.csv.
        optima: folder of the solutions.
        fresh: solve everything again.
        machines: what solves them.
        front: also the energy weights beside the default one.

    Raises:
        ValueError: CasADi is not installed.
    """
    if find_spec("casadi") is None:
        raise ValueError('casadi must be installed to solve, got none: pip install -e ".[optimal]"')
    for place in (output, optima):
        check_writable(place)
    started = time.monotonic()
    todo = [cell for cell in cells(front) if fresh or cached(cell, optima) is None]
    failures = run_cells(todo, optima, machines)
    write_summary(output, optima, failures)
    for name, reason in failures.items():
        print(f"failed: {name}: {reason}")
    minutes = (time.monotonic() - started) / 60.0
    print(
        f"{len(todo) - len(failures)} of {len(todo)} problems solved in {minutes:.1f} minutes: {output / 'optimal.csv'}"
    )

"""Learning curves against control periods and seconds, and the time until the PD was beaten."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from agents.files import write_csv, write_text, write_whole
from agents.shipped import CURVES
from agents.style import CONTROLLER_COLOURS, CONTROLLER_NAMES, ELBOW_NAMES, pyplot
from agents.tasks import POLICY_NAME
from benchmarks.machine import RESULTS
from benchmarks.optimal import Cell, cached
from elbow_gym.baselines.tasks import task_name
from elbow_gym.suite import ENV as TASKS_ENV

Array = NDArray[np.float64]

POINTS = 200
TASKS = {**{f"elbows{elbows}": ELBOW_NAMES[elbows] for elbows in (2, 1, 0)}, "table": "table", "random": "drawn arms"}
TASKS |= {task_name(TASKS_ENV, elbows): f"drawn tasks, {ELBOW_NAMES[elbows]}" for elbows in (2, 1, 0)}
AXES = {"steps": "control periods", "training_seconds": "seconds of training, one core a seed"}
"""Labels of the horizontal axes by column of the curves."""


class Goal(NamedTuple):
    """Energy of the PD in regime A [J] and its error in regime B [mm]; below both it is beaten."""

    energy: float
    error: float


@dataclass(frozen=True)
class Curve:
    """The evaluations of one training seed."""

    controller: str
    task: str
    seed: int
    columns: Mapping[str, Array]
    """Columns by name as in `agents.learning.evaluation.COLUMNS`, each of shape (evaluations,)."""

    def beats(self, goal: Goal) -> dict[str, float] | None:
        """Steps and seconds at the first evaluation that is below the PD in both metrics; None when none is."""
        below = (self.columns["electrical_energy"] < goal.energy) & (self.columns["steady_error_rms_mm"] < goal.error)
        if not below.any():
            return None
        first = int(np.argmax(below))
        return {name: float(self.columns[name][first]) for name in ("steps", "training_seconds", "wall_seconds")}


def load(folder: Path) -> list[Curve]:
    """The curves in a folder of CONTROLLER_TASK_seedK.csv files, as `python -m agents publish` writes them."""
    curves = []
    for path in sorted(folder.glob("*_seed*.csv")):
        name, _, seed = path.stem.rpartition("_seed")
        parts = POLICY_NAME.fullmatch(name)
        if parts is None or not seed.isdigit():
            raise ValueError(f"curves must be named ALGORITHM_TASK_seedK.csv, got {path.name}")
        with path.open(newline="", encoding="utf-8") as handle:
            rows = list(csv.reader(handle))
        table = np.array(rows[1:], dtype=np.float64)
        names = [title.split(" ")[0] for title in rows[0]]
        columns = {title: table[:, k] for k, title in enumerate(names)}
        curves.append(Curve(parts["controller"], parts["task"], int(seed), columns))
    return curves


def together(curves: Sequence[Curve], against: str, what: str = "return") -> tuple[Array, Array, Array, Array]:
    """Seeds on one grid, as far as the shortest goes: the grid, the interquartile mean, and the lowest and highest."""
    end = min(float(curve.columns[against][-1]) for curve in curves)
    grid = np.linspace(0.0, end, POINTS)
    values = np.array([np.interp(grid, curve.columns[against], curve.columns[what]) for curve in curves])
    return grid, stats.trim_mean(values, 0.25, axis=0), values.min(axis=0), values.max(axis=0)


def goals(results: Path) -> dict[str, Goal]:
    """Goals by task, as far as the energy benchmark has the PD's metrics."""
    rows = _pd_rows(results)
    return {
        task: Goal(float(rows[task, "A"]["electrical_energy [J]"]), float(rows[task, "B"]["error_rms [mm]"]))
        for task in {task for task, _ in rows}
    }


def _pd_rows(results: Path) -> dict[tuple[str, str], dict[str, str]]:
    found = {}
    for stem in ("energy", "energy_table"):
        path = results / f"{stem}.csv"
        if path.is_file():
            with path.open(newline="", encoding="utf-8") as handle:
                for row in csv.DictReader(handle):
                    if row["controller"] == "pd":
                        task = "table" if stem == "energy_table" else f"elbows{row['elbows']}"
                        found[task, row["regime"]] = row
    return found


HEADER = ("controller", "task", "seeds", "beat the PD", "steps", "training seconds", "wall seconds", "best return")


def table(curves: Sequence[Curve], results: Path) -> list[tuple[str, ...]]:
    """Number of seeds that beat the PD in both energy and error, and when (median), for each controller and task."""
    known, rows = goals(results), []
    for controller, task in _groups(curves):
        chosen = [curve for curve in curves if (curve.controller, curve.task) == (controller, task)]
        moments = [curve.beats(known[task]) for curve in chosen] if task in known else []
        beaten = [moment for moment in moments if moment is not None]
        best = [float(curve.columns["return"].max()) for curve in chosen]
        when = [
            f"{np.median([moment[name] for moment in beaten]):.3g}" if beaten else "-"
            for name in ("steps", "training_seconds", "wall_seconds")
        ]
        count = f"{len(beaten)}" if task in known else "-"
        rows.append((controller, task, f"{len(chosen)}", count, *when, f"{stats.trim_mean(best, 0.25):.4g}"))
    return rows


def _groups(curves: Sequence[Curve]) -> list[tuple[str, str]]:
    order = list(TASKS)
    return sorted(
        {(curve.controller, curve.task) for curve in curves}, key=lambda group: (order.index(group[1]), group)
    )


def figure(curves: Sequence[Curve], results: Path, path: Path) -> None:
    """One row per task: cost (minus return) against control periods and against seconds, bound and PD as lines."""
    plt = pyplot()
    tasks = [task for task in TASKS if any(curve.task == task for curve in curves)]
    fig, axes = plt.subplots(
        len(tasks), len(AXES), figsize=(9, 1.2 + 2.4 * len(tasks)), squeeze=False, sharey="row", layout="constrained"
    )
    from matplotlib.ticker import EngFormatter

    papers = _pd_rows(results)
    for line, task in enumerate(tasks):
        for ax, (against, label) in zip(axes[line], AXES.items(), strict=True):
            for controller in dict.fromkeys(curve.controller for curve in curves if curve.task == task):
                chosen = [curve for curve in curves if (curve.controller, curve.task) == (controller, task)]
                grid, mean, low, high = together(chosen, against)
                colour = CONTROLLER_COLOURS[controller]
                ax.plot(grid, -mean, color=colour, label=CONTROLLER_NAMES[controller])
                ax.fill_between(grid, -high, -low, color=colour, alpha=0.2, lw=0)
            _mark(ax, task, papers)
            ax.set_yscale("log")
            ax.set_xlim(left=0.0)
            ax.xaxis.set_major_formatter(EngFormatter(sep=""))
            ax.set_title(TASKS[task])
            if line == len(tasks) - 1:
                ax.set_xlabel(label)
        axes[line, 0].set_ylabel("minus return (-)")
    named: dict[str, Any] = {}
    for ax in axes.flat:
        handles, labels = ax.get_legend_handles_labels()
        named.update(zip(labels, handles, strict=True))
    fig.legend(named.values(), named.keys(), loc="outside upper center", ncols=4)
    fig.savefig(path)
    plt.close(fig)


def _mark(ax: Any, task: str, papers: Mapping[tuple[str, str], Mapping[str, str]]) -> None:
    if (task, "A") in papers:
        level = -float(papers[task, "A"]["return [-]"])
        ax.axhline(level, color=CONTROLLER_COLOURS["pd"], ls="--", label=CONTROLLER_NAMES["pd"])
    best = cached(Cell(int(task.removeprefix("elbows")), "paper")) if task.startswith("elbows") else None
    if best is not None:
        ax.axhline(float(best["closed_loop"]), color="black", ls=":", label="optimal bound")


def save(results: Path = RESULTS, folder: Path = CURVES) -> list[tuple[str, ...]]:
    """Writes learning.png, learning.csv and learning.md into `results` from the curves in `folder`, if there are any.

    The PD's metrics are those of energy.csv and energy_table.csv in `results`.
    """
    curves = load(folder)
    if not curves:
        return []
    rows = table(curves, results)
    write_csv(results / "learning.csv", HEADER, rows)
    lines = [HEADER, ("---",) * len(HEADER), *((CONTROLLER_NAMES[row[0]], TASKS[row[1]], *row[2:]) for row in rows)]
    write_text(results / "learning.md", "".join(f"| {' | '.join(line)} |\n" for line in lines))
    write_whole(results / "learning.png", lambda temporary: figure(curves, results, temporary))
    return rows

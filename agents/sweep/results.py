"""Results of a sweep: one row a trial, over its seeds, as a table, a CSV file and a figure."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agents.evaluation.interquartile import Estimate, interquartile_mean
from agents.files import write_csv, write_text, write_whole
from agents.learning.evaluation import COLUMNS
from agents.learning.run import Run
from agents.style import look, pyplot
from agents.sweep.plan import Trial

FIGURES = {
    "return": ("return", "return [-]"),
    "electrical_energy": ("energy (J)", "energy [J]"),
    "steady_error_rms_mm": ("error (mm)", "error when steady [mm]"),
    "hours": ("hours", "hours of training, all seeds"),
}
"""A trial's figures: title of the column and label of the axis. All but the hours are of each seed's best policy."""
STEPS, WALL = list(COLUMNS).index("steps"), list(COLUMNS).index("wall_seconds")


Trials = Mapping[str, tuple[Trial, Sequence[Run]]]
"""Trials and their runs by the trials' names."""


@dataclass(frozen=True)
class Row:
    """A trial and what came of it."""

    trial: Trial
    label: str
    """What tells it from the others, for a reader."""
    seeds: int
    """Number of seeds that have a policy."""
    done: float
    """Share of the training that is done, of the seed that has the least [-]."""
    figures: Mapping[str, Estimate]
    """Interquartile means over the seeds, and the hours in all; empty without a policy."""
    best: bool = False
    """Whether it has the best return of all that are trained to the end for its task."""

    @property
    def merit(self) -> float:
        """The return that trials of a task are compared by."""
        return self.figures["return"].value if self.figures else -np.inf


def row(trial: Trial, runs: Sequence[Run], label: str) -> Row:
    """A trial's row from the folders of its runs."""
    cards, hours, done = [], 0.0, []
    for run in runs:
        policy, rows = run.files.best(), run.files.evaluations()
        done.append(rows[-1][STEPS] / run.settings.total_timesteps if rows else 0.0)
        result = run.files.result()
        if result is not None and result["finished"]:
            done[-1] = 1.0
        if policy is not None:
            cards.append(policy.card.evaluation)
            hours += rows[-1][WALL] / 3600.0 if rows else 0.0
    figures = {}
    if cards:
        # Seeds are drawn for the interval, which has one sample of each.
        figures = {name: interquartile_mean([[card[name]] for card in cards]) for name in FIGURES if name != "hours"}
        figures["hours"] = Estimate(hours, hours, hours)
    return Row(trial, label, len(cards), min(done), figures)


def rows_of(trials: Trials) -> list[Row]:
    """Rows of all trials, those of a task together and the best return first."""
    labels = labelled([trial for trial, _ in trials.values()])
    rows = [row(trial, runs, labels[name]) for name, (trial, runs) in trials.items()]
    order = list(dict.fromkeys(one.trial.question for one in rows))
    rows.sort(key=lambda one: (order.index(one.trial.question), -one.merit))
    best: dict[Any, Row] = {}
    for one in rows:
        if one.figures and one.done >= 1.0:
            best.setdefault(one.trial.question, one)
    return [Row(**{**vars(one), "best": best.get(one.trial.question) is one}) for one in rows]


def labelled(trials: Sequence[Trial]) -> dict[str, str]:
    """Labels by the trials' names: algorithm and task, and the settings and arguments in which trials of one differ."""
    given = {trial.name: {**trial.changes, **trial.task.environment} for trial in trials}
    labels = {}
    for trial in trials:
        alike = [given[one.name] for one in trials if one.algorithm == trial.algorithm]
        own = given[trial.name]
        told = [name for name in own if len({json.dumps(one.get(name)) for one in alike}) > 1]
        labels[trial.name] = ", ".join(
            [f"{trial.algorithm} {trial.task.name}", *(f"{name} {_plain(own[name])}" for name in told)]
        )
    return labels


def _plain(value: Any) -> str:
    return ",".join(map(str, value)) if isinstance(value, tuple | list) else str(value)


def markdown(rows: Sequence[Row]) -> str:
    """Table of the rows; the best of each task is bold."""
    titles = ["trial", "seeds", "trained", *(title for title, _ in FIGURES.values())]
    lines = [titles, ["---"] * len(titles)]
    for one in rows:
        name = f"**{one.label}**" if one.best else one.label
        figures = [_number(one.figures.get(figure)) for figure in FIGURES]
        lines.append([name, str(one.seeds), f"{100.0 * one.done:.0f} %", *figures])
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n"


def _number(estimate: Estimate | None) -> str:
    if estimate is None:
        return "-"
    value, low, high = (f"{number:.4g}" for number in estimate)
    return value if low == high else f"{value} ({low} to {high})"


def save(rows: Sequence[Row], folder: Path) -> list[Path]:
    """Writes sweep.md, sweep.csv and sweep.png, and returns their paths."""
    columns = [f"{name}{end}" for name in FIGURES for end in ("", "_low", "_high")]
    header = ["trial", "algorithm", "env", "task", "settings", "environment", "seeds", "done", "best", *columns]
    lines = [
        [
            one.trial.name,
            one.trial.algorithm,
            *one.trial.question[:2],
            json.dumps(one.trial.changes),
            one.trial.question[2],
            one.seeds,
            f"{one.done:.4g}",
            int(one.best),
            *(
                f"{number:.6g}" if one.figures else ""
                for name in FIGURES
                for number in one.figures.get(name, (0.0, 0.0, 0.0))
            ),
        ]
        for one in rows
    ]
    return [
        write_text(folder / "sweep.md", markdown(rows)),
        write_csv(folder / "sweep.csv", header, lines),
        write_whole(folder / "sweep.png", lambda temporary: figure(rows, temporary)),
    ]


def figure(rows: Sequence[Row], path: Path) -> None:
    """A panel for each of `FIGURES`, a line for each trial, the best return of a task at the top; bars are 95 %."""
    plt = pyplot()
    shown = [one for one in rows if one.figures]
    size = (11, 1.4 + 0.3 * max(1, len(shown)))
    fig, axes = plt.subplots(1, len(FIGURES), figsize=size, sharey=True, layout="constrained")
    for ax, (name, (_, label)) in zip(axes, FIGURES.items(), strict=True):
        for k, one in enumerate(shown):
            value, low, high = one.figures[name]
            _, colour, marker = look(one.trial.algorithm)
            ax.errorbar(
                [value], [k], xerr=[[value - low], [high - value]], fmt=marker, color=colour,
                fillstyle="full" if one.done >= 1.0 else "none",
            )  # fmt: skip
        ax.set_xlabel(label)
    axes[0].set_yticks(range(len(shown)), [f"{one.label}{' (best)' if one.best else ''}" for one in shown])
    axes[0].invert_yaxis()
    fig.savefig(path)
    plt.close(fig)

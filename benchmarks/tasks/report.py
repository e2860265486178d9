"""Tables and figure of the comparison on the evaluation tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from agents.evaluation.interquartile import Estimate
from agents.files import write_csv
from agents.style import elbow_name, look, pyplot
from benchmarks.energy.markdown import percent, pipes, significant
from benchmarks.tasks.episodes import DISTURBANCES, NOMINAL
from benchmarks.tasks.scores import Key, Score

HEADER = (
    "elbows",
    "controller",
    "gap, median",
    "gap, interquartile mean",
    "gap, 90th percentile",
    "share of the gain",
    "energy (J)",
    "error (mm)",
    "below the table (s)",
    "failures",
    "seeds",
)
OPTIMUM = "optimum"
LINEAR = 1.0
"""Gap up to which the figure's axis is linear [%]."""
MARKED = 8
"""Number of markers on a line of the figure."""


def table(found: Sequence[Score], optima: Mapping[Key, Mapping[str, float]]) -> str:
    """A line for each player under the optimum's, by elbow count."""
    lines: list[tuple[str, ...]] = [HEADER]
    for elbows in dict.fromkeys(one.elbows for one in found):
        best = [figures for (count, _), figures in optima.items() if count == elbows]
        medians = [significant(float(np.median([of[name] for of in best]))) for name in ("energy", "error_rms")]
        lines.append(
            (str(elbows), f"{OPTIMUM}, {len(best)} tasks", "0 %", "0 %", "0 %", "100 %", *medians, "", "", "-")
        )
        lines += [_line(one) for one in found if one.elbows == elbows]
    return pipes(lines)


def _line(one: Score) -> tuple[str, ...]:
    seeds, tasks = one.gaps.shape
    return (
        str(one.elbows),
        look(one.name)[0],
        *(_interval(estimate) for estimate in (one.median, one.middle, one.tail)),
        percent(one.share),
        significant(one.energy),
        significant(one.error),
        f"{one.below:.2f}",
        f"{one.failures} of {seeds * tasks}",
        str(seeds),
    )


def _interval(estimate: Estimate) -> str:
    """Estimate in percent with its 95 % interval."""
    value, low, high = (significant(100.0 * number) for number in estimate)
    return f"{value} [{low}, {high}] %"


def disturbed_table(found: Sequence[Score]) -> str:
    """Cost of each disturbance to each player, in percent of the optimum's cost; empty where none was played.

    Players that played undisturbed alone are left out.
    """
    names = [name for name in DISTURBANCES if name != NOMINAL and any(name in one.losses for one in found)]
    if not names:
        return ""
    lines = [("elbows", "controller", *names)]
    for one in (one for one in found if one.losses):
        lines.append((str(one.elbows), look(one.name)[0], *(_interval(one.losses[name]) for name in names)))
    return pipes(lines)


def write_scores(found: Sequence[Score], path: Path) -> None:
    """Writes all scores with their intervals."""
    estimates = ("median", "middle", "tail")
    ways = [name for name in DISTURBANCES if name != NOMINAL]
    header = ["elbows", "controller", "seeds [-]", "tasks [-]"]
    header += [f"gap_{name} [-]{part}" for name in estimates for part in ("", " low", " high")]
    header += ["share [-]", "energy [J]", "error_rms [mm]", "below_table [s]", "failures [-]"]
    header += [f"loss_{name} [-]{part}" for name in ways for part in ("", " low", " high")]
    rows = []
    for one in found:
        gaps = [number for name in estimates for number in getattr(one, name)]
        losses = [number for name in ways for number in one.losses.get(name, ("", "", ""))]
        figures = [*gaps, one.share, one.energy, one.error, one.below, one.failures, *losses]
        plain = [f"{value:.6g}" if isinstance(value, float) else value for value in figures]
        rows.append([one.elbows, one.name, *one.gaps.shape, *plain])
    write_csv(path, header, rows)


def figure(found: Sequence[Score], path: Path) -> None:
    """Gaps of all episodes in ascending order, a line for each player and a panel for each elbow count."""
    plt = pyplot()
    counts = list(dict.fromkeys(one.elbows for one in found))
    fig, axes = plt.subplots(1, len(counts), figsize=(3.6 * len(counts) + 1.0, 4.2), sharey=True, squeeze=False)
    fig.set_layout_engine("constrained")
    named = {}
    for ax, elbows in zip(axes[0], counts, strict=True):
        for one in (one for one in found if one.elbows == elbows):
            label, colour, marker = look(one.name)
            gaps = 100.0 * np.sort(one.gaps.ravel())
            share = 100.0 * np.arange(1, gaps.size + 1) / gaps.size
            (named[label],) = ax.plot(
                share, gaps, color=colour, marker=marker, markevery=max(1, gaps.size // MARKED), ms=4.5, lw=1.4
            )
        ax.axhline(0.0, color="black", lw=0.8)
        ax.set_yscale("symlog", linthresh=LINEAR)
        ax.yaxis.set_major_formatter("{x:g}")
        ax.set_xlim(0.0, 100.0)
        ax.set_xlabel("share of the episodes (%)")
        ax.set_title(elbow_name(elbows))
    axes[0, 0].set_ylim(bottom=min(-LINEAR, 120.0 * min(float(one.gaps.min()) for one in found)))
    axes[0, 0].set_ylabel("gap to the task's optimum, at most (%)")
    fig.legend(named.values(), named.keys(), loc="outside upper center", ncols=min(len(counts) + 1, len(named)))
    fig.savefig(path)
    plt.close(fig)

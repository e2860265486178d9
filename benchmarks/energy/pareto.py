"""Front of energy against tracking error, with the controllers beside it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from agents.files import write_csv
from agents.style import CONTROLLER_COLOURS, elbow_name, look, pyplot
from benchmarks.optimal import cached, cells

if TYPE_CHECKING:
    from benchmarks.energy.rows import Row


class Mark(NamedTuple):
    """A controller's place in the figure: mean tracking error [mm] and electrical energy [J] of regime A."""

    controller: str
    elbows: int
    error: float
    energy: float
    gain: float = 1.0
    """Factor on both gains of the paper's PD [-]."""


def marks(rows: Sequence[Row]) -> list[Mark]:
    """Every controller's place beside the front."""
    return [
        Mark(
            row.controller,
            row.elbows,
            row.figures["error_mean"].value,
            row.figures["electrical_energy"].value,
            row.gain,
        )
        for row in rows
        if row.regime == "A"
    ]


def gain_family(places: Sequence[Mark], elbows: int) -> list[Mark]:
    """The paper's PD at 24 V with all its gains, softest first; empty when only the paper's were played."""
    family = sorted((m for m in places if m.controller == "pd" and m.elbows == elbows), key=lambda m: m.gain)
    return family if len(family) > 1 else []


def write_gains(places: Sequence[Mark], path: Path) -> None:
    """Writes the PD's place for every gain."""
    header = ["elbows", "gain [-]", "error_mean [mm]", "electrical_energy [J]"]
    counts = sorted({mark.elbows for mark in places}, reverse=True)
    rows = [
        [mark.elbows, f"{mark.gain:g}", f"{mark.error:.6g}", f"{mark.energy:.6g}"]
        for elbows in counts
        for mark in gain_family(places, elbows)
    ]
    write_csv(path, header, rows)


def front(elbows: int) -> list[tuple[float, float]]:
    """Mean tracking error [mm] and energy [J] of the solved cells from the paper's pose, by falling energy."""
    chosen = [cell for cell in cells() if cell.elbows == elbows and cell.start == "paper" and not cell.under]
    solved = [cached(cell) for cell in chosen]
    points = [(1e3 * figures["error_mean"], figures["energy"]) for figures in solved if figures]
    return sorted(points)


def figure(places: Sequence[Mark], path: Path) -> None:
    """One panel per elbow count: the front as a line, the controllers as marks, on logarithmic axes."""
    plt = pyplot()
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    counts = sorted({mark.elbows for mark in places}, reverse=True)
    fig, axes = plt.subplots(1, len(counts), figsize=(10, 4.4), squeeze=False, layout="constrained")
    for ax, elbows in zip(axes[0], counts, strict=True):
        points = front(elbows)
        if points:
            ax.plot(*zip(*points, strict=True), "-", color="black", marker=".", label="optimal front")
        family = gain_family(places, elbows)
        if family:
            line = [(mark.error, mark.energy) for mark in family]
            colour = CONTROLLER_COLOURS["pd"]
            ax.plot(*zip(*line, strict=True), ":", color=colour, marker=".", label="PD, 24 V, gains x 1/4 to 4")
        for mark in (mark for mark in places if mark.elbows == elbows and mark.gain == 1.0):
            name, colour, marker = look(mark.controller)
            ax.plot(
                mark.error,
                mark.energy,
                marker,
                color=colour,
                markeredgecolor="black",
                markeredgewidth=0.5,
                markersize=9 if mark.controller == "lqr" else 7,
                label=name,
            )
        ax.set_xscale("log")
        ax.set_yscale("log")
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.set_minor_formatter(NullFormatter())
        ax.set_title(elbow_name(elbows))
        ax.set_xlabel("mean tracking error, 0-5 s (mm)")
    axes[0, 0].set_ylabel("electrical energy, 0-5 s (J)")
    named = {}
    for ax in axes[0]:
        handles, labels = ax.get_legend_handles_labels()
        named.update(zip(labels, handles, strict=True))
    fig.legend(named.values(), named.keys(), loc="outside upper center", ncols=4)
    fig.savefig(path)
    plt.close(fig)

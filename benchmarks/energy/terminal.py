"""Report of the energy benchmark on the terminal: plain lines of at most 80 columns, and their meaning."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from agents.evaluation.metrics import REGIMES
from agents.style import elbow_name, look
from benchmarks.energy.cells import PARTS
from benchmarks.energy.markdown import by_player, percent, significant
from benchmarks.energy.rows import Row

WIDTH = 80
LABEL_WIDTH = 29
COLUMN_WIDTH = 8


class Column(NamedTuple):
    """A column of the report."""

    quantity: str
    regime: str
    unit: str
    figure: Callable[[Row], str]


def _of(metric: str) -> Callable[[Row], str]:
    return lambda row: significant(row.figures[metric].value)


COLUMNS = (
    Column("return", "A", "", _of("return")),
    Column("gap", "A", "", lambda row: "" if row.gap is None else percent(row.gap)),
    Column("energy", "A", "J", _of("electrical_energy")),
    Column("energy", "B", "J", _of("electrical_energy")),
    Column("error", "B", "mm", _of("error_rms")),
    Column("energy", "C", "J", _of("electrical_energy")),
)


def table(rows: Sequence[Row]) -> str:
    """A line for each controller under each elbow count, the best return first; columns that all lack are left out."""
    grouped = by_player(rows)
    regimes = {row.regime for row in rows}
    bounded = any(row.gap is not None for row in rows)
    columns = [column for column in COLUMNS if column.regime in regimes and (column.quantity != "gap" or bounded)]
    head = "".join(f"{column.quantity:>{COLUMN_WIDTH}}" for column in columns)
    below = "".join(f"{', '.join(filter(None, (c.regime, c.unit))):>{COLUMN_WIDTH}}" for c in columns)
    lines = []
    for elbows in dict.fromkeys(count for count, _ in grouped):
        name = "the table" if rows[0].part == "table" else elbow_name(elbows)
        lines += ["", f"{name:<{LABEL_WIDTH}}{head}".rstrip(), f"{'':<{LABEL_WIDTH}}{below}"]
        for (count, controller), of in grouped.items():
            if count == elbows:
                cells = (column.figure(of[column.regime]) for column in columns)
                label = look(controller)[0][: LABEL_WIDTH - 1]
                lines.append(f"  {label:<{LABEL_WIDTH - 2}}" + "".join(f"{c:>{COLUMN_WIDTH}}" for c in cells))
    return "\n".join(lines[1:])


def meaning(rows: Sequence[Row]) -> str:
    """Sentence on what bracing and control change in the nominal part; empty where the players are missing."""
    energies = {
        (controller, elbows): of["A"].figures["electrical_energy"].value
        for (elbows, controller), of in by_player(rows).items()
    }
    told = []
    for controller in ("pd", "computed_torque", "sac"):
        if {(controller, 2), (controller, 0)} <= energies.keys():
            two, none = energies[controller, 2], energies[controller, 0]
            told.append(
                f"{look(controller)[0]} takes {significant(two)} J with two elbows on the table and "
                f"{significant(none)} J with none, {significant(none / two)} times as much"
            )
    return f"What bracing saves in the whole run: {'; '.join(told)}." if told else ""


def report(rows: Sequence[Row], poses: int, every_seed: bool, written: Sequence[Path]) -> str:
    """Text that the command prints at its end.

    Args:
        rows: of all parts.
        poses: start poses of each cell.
        every_seed: whether all training seeds played.
        written: the folder of the results first, then files that changed beside them.
    """
    parts = []
    for part, what in PARTS.items():
        chosen = [row for row in rows if row.part == part and row.gain == 1.0]
        if chosen:
            parts += [f"{part.capitalize()} part: {what}", table(chosen)]
    nominal = [row for row in rows if row.part == "nominal" and row.gain == 1.0]
    training = "all training seeds" if every_seed else "the best training seed"
    figures = f"Each number is the interquartile mean over {poses} start poses"
    figures += f", of learned controllers with {training}." if any(row.seeds for row in rows) else "."
    regimes = "; ".join(f"{regime.name}: {regime.meaning}" for regime in REGIMES)
    gap = ""
    if any(row.gap is not None for row in rows):
        gap = " Gap: excess over the least cost (minus the return) that optimal control has found."
    sentences = [
        meaning(nominal),
        f"{figures} {regimes}.{gap}",
        f"Files: {', '.join(_short(path) for path in written)}",
    ]
    if not every_seed:
        sentences[-1] += (
            " (energy.csv, energy.md, energy.png, effort.csv). All parts, poses and training seeds: --full."
        )
    return "\n\n".join(parts + [textwrap.fill(text, WIDTH, break_long_words=False) for text in sentences if text])


def _short(path: Path) -> str:
    """The path from here, if it is below."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)

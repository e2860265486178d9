"""Time that every controller of the energy benchmark takes for a decision, with the machine that took it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from agents.evaluation.effort import decision_time
from agents.files import write_csv
from agents.machine import machine, versions
from benchmarks.energy.cells import Cell, players

HEADER = ("controller", "elbows", "decision [ms]", "processor", "vectors", "python", "numpy")


def timed(cell: Cell) -> bool:
    """Whether the time of a decision of the cell's controllers is taken, for one arm."""
    return cell.part == "nominal" and cell.gain == 1.0


def save(cells: Sequence[Cell], path: Path) -> None:
    """Measures the best training seed of every nominal cell, here and one after the other, and writes a row for each.

    A file of its own, since the other files of results are the same byte for byte whenever they are made again.
    """
    here = machine()
    place = [here["processor"], here["vectors"], here["python"], versions("numpy")["numpy"]]
    rows = [
        [cell.controller, cell.elbows, f"{1e3 * decision_time(players(cell, every_seed=False)[0]):.3g}", *place]
        for cell in cells
        if timed(cell)
    ]
    write_csv(path, HEADER, rows)

"""Command `python -m agents report`, which plays every controller and writes the page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from agents.evaluation.guest import Guest
from agents.evaluation.players import ELBOW_COUNTS, entries
from agents.files import check_writable, write_text
from agents.report.page import page
from agents.report.runs import Visitor, collect

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results"
"""Folder of the results of `python -m benchmarks`, which are only read here."""


def report(output: Path, results: Path = RESULTS, guests: Sequence[Guest] = ()) -> Path:
    """Plays every controller without start noise and writes the page, whole or not at all.

    Args:
        output: the HTML file.
        results: folder of the benchmark's results: its tables and its front.
        guests: players of a user's own, which play beside the others.

    Raises:
        ValueError: a guest does not fit the environment.
    """
    check_writable(output.parent)
    visitors = [Visitor(guest, elbows) for guest in guests for elbows in guest.plays_at(ELBOW_COUNTS)]
    runs = collect([*entries(), *visitors])
    write_text(output, page(runs, results))
    print(f"{output}: {len(runs)} runs, {output.stat().st_size / 1e6:.1f} MB")
    return output

"""Command `python -m agents report`, which plays every controller and writes the page."""

from __future__ import annotations

import sys
from pathlib import Path

from agents.files import write_text
from agents.report.page import page
from agents.report.roster import roster
from agents.report.runs import collect

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results"
"""Folder of the results of `python -m benchmarks`, which are only read here."""


def report(output: Path, results: Path = RESULTS) -> Path:
    """Plays every controller without start noise and writes the page, whole or not at all.

    Args:
        output: the HTML file.
        results: folder of the benchmark's results: its tables and its front.
    """
    from tqdm import tqdm

    entries = roster()
    layout = "{desc} {percentage:3.0f}%|{bar}| {elapsed} elapsed, {remaining} left"
    total = sum(entry.size for entry in entries)
    # Work is told of in bursts: the time left follows the mean speed.
    with tqdm(total=total, desc="playing", bar_format=layout, smoothing=0.0, file=sys.stderr) as bar:
        runs = collect(entries, bar.update)
        bar.set_description("writing")
    write_text(output, page(runs, results))
    print(f"{output}: {len(runs)} runs, {output.stat().st_size / 1e6:.1f} MB")
    return output

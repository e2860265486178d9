"""`python -m benchmarks energy`: every controller in every regime; tables, CSV, JSON and figures."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from datetime import datetime, timezone
from functools import partial
from pathlib import Path

import numpy as np

from agents.evaluation.metrics import REGIMES, UNITS
from agents.evaluation.players import BENCHMARK_SEEDS, SHIFTED, in_all_regimes
from agents.files import write_text, write_whole
from agents.workers import Job, Tell, in_processes
from benchmarks import learning
from benchmarks.energy import breakdown, cache, pareto
from benchmarks.energy import figures as energy_figure
from benchmarks.energy import markdown as energy_table
from benchmarks.energy.cache import Results
from benchmarks.energy.cells import PARTS, Cell, Contender, cells, contenders, starts, sweep, work
from benchmarks.energy.rows import Row
from benchmarks.energy.statistics import interquartile_mean
from benchmarks.machine import PACKAGES, RESULTS, machine, versions
from benchmarks.optimal import Cell as Bound
from benchmarks.optimal import cached as cached_bound


def bound(cell: Cell, regime: str) -> float | None:
    """The best known negative return from the start without noise; None where none was sought."""
    chosen = next(one for one in REGIMES if one.name == regime)
    figures = cached_bound(Bound(cell.elbows, chosen.start)) if chosen.since == 0.0 else None
    return None if figures is None or cell.part != "nominal" else float(figures["closed_loop"])


def play(cell: Cell, seeds: Sequence[int], folder: Path, fresh: bool, tell: Tell) -> list[Results]:
    """The results of a cell's contenders, each from `folder` where the same was measured before.

    Args:
        cell: what is played.
        seeds: of the episodes.
        folder: where results are kept.
        fresh: measure again all the same.
        tell: called with the units of work done, `work` in all when all is measured.
    """
    measured = []
    for player in contenders(cell):
        question = {
            "settings": player.settings.arguments,
            "identity": player.identity,
            "seeds": list(seeds),
            "regimes": [regime.name for regime in cell.regimes],
            "versions": versions("numpy", "numba", "scipy"),
        }
        name = cache.key(json.loads(json.dumps(question)))
        results = None if fresh else cache.load(name, folder)
        if results is None:
            results = in_all_regimes(player.settings, player.make, seeds, _counted(player, tell), cell.regimes)
            cache.store(name, results, folder)
        else:
            tell(len(starts(cell)) * player.work)
        measured.append(results)
    return measured


def _counted(player: Contender, tell: Tell) -> Callable[[int, int], None]:
    """A callback for `record` that tells the work done since its last call."""
    before = 0

    def progress(done: int, total: int) -> None:
        nonlocal before
        # A second run, from the other start, counts from zero again.
        before = before if before < done else 0
        tell(player.work * done // total - player.work * before // total)
        before = done

    return progress


def rows_of(cell: Cell, measured: Sequence[Results]) -> list[Row]:
    """A cell's rows from the results of its contenders."""
    players = contenders(cell)
    rows = []
    for regime in cell.regimes:
        values = {name: np.stack([results[regime.name][name] for results in measured]) for name in UNITS}
        joints = np.concatenate([results[regime.name]["joint_energy"] for results in measured])
        figures = {name: interquartile_mean(samples) for name, samples in values.items()}
        own = [
            {"seed": player.seed, **{name: interquartile_mean(values[name][k]).value for name in UNITS}}
            for k, player in enumerate(players)
            if player.seed is not None
        ]
        best = bound(cell, regime.name)
        rows.append(
            Row(
                cell.controller,
                cell.elbows,
                regime.name,
                figures,
                tuple(interquartile_mean(column).value for column in joints.T),
                cell.part,
                cell.gain,
                tuple(own),
                None if best is None else (-figures["return"].value - best) / abs(best),
            )
        )
    return rows


def measure(
    seeds: Sequence[int],
    tell: Tell,
    folder: Path = cache.FOLDER,
    fresh: bool = False,
    parallel: bool = True,
) -> list[Row]:
    """Plays all cells, one on each core when `parallel`; `tell` gets the units of `work` done."""
    everything = cells() + sweep()
    if parallel:
        jobs = {cell: Job(partial(play, cell, seeds, folder, fresh), work(cell)) for cell in everything}
        measured = in_processes(jobs, tell)
    else:
        measured = {cell: play(cell, seeds, folder, fresh, tell) for cell in everything}
    return [row for cell in everything for row in rows_of(cell, measured[cell])]


def save(rows: Sequence[Row], seeds: Sequence[int], seconds: float, folder: Path) -> None:
    """Writes the tables, the figures and what made them, each file whole.

    energy.csv and .md (nominal part), energy_brief.md of it, energy_shifted.*, energy_table.*, energy_seeds.csv,
    energy.json; energy.png, energy_joints.png, pareto.png, pareto_gains.csv; breakdown.* of the paper's PD; learning.*
    where curves are there.
    """
    played = [row for row in rows if row.gain == 1.0]
    for part in PARTS:
        chosen = [row for row in played if row.part == part]
        stem = "energy" if part == "nominal" else f"energy_{part}"
        if chosen:
            energy_table.write_rows(chosen, folder / f"{stem}.csv")
            write_text(folder / f"{stem}.md", energy_table.markdown(chosen))
    nominal = [row for row in played if row.part == "nominal"]
    write_text(folder / "energy_brief.md", energy_table.brief(nominal))
    energy_table.write_seeds(played, folder / "energy_seeds.csv")
    context = {
        "command": "python -m benchmarks " + " ".join(sys.argv[1:]),
        "made": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "seconds": round(seconds, 1),
        "seeds": list(seeds),
        "shifted": SHIFTED,
        "machine": machine(),
        "versions": versions(*PACKAGES),
    }
    write_text(folder / "energy.json", json.dumps(context, indent=2) + "\n")
    write_whole(folder / "energy.png", lambda temporary: energy_figure.figure(nominal, temporary))
    write_whole(folder / "energy_joints.png", lambda temporary: energy_figure.joints(nominal, temporary))
    marks = pareto.marks([row for row in rows if row.part == "nominal"])
    write_whole(folder / "pareto.png", lambda temporary: pareto.figure(marks, temporary))
    pareto.write_gains(marks, folder / "pareto_gains.csv")
    papers = {(row.elbows, row.regime): row.joint_energy for row in nominal if row.controller == "pd_paper"}
    if papers:
        counts = list(dict.fromkeys(elbows for elbows, _ in papers))
        breakdown.save(breakdown.breakdown(lambda elbows, regime: papers[elbows, regime], counts), folder)
    learning.save(folder)


def energy(
    output: Path = RESULTS,
    episodes: int = len(BENCHMARK_SEEDS),
    fresh: bool = False,
    folder: Path = cache.FOLDER,
    parallel: bool = True,
) -> list[Row]:
    """Runs the comparison, prints the tables and writes the results. Returns the rows.

    Args:
        output: folder for the results.
        episodes: start poses, one fixed seed each.
        fresh: play what was played before, too.
        folder: where results of single cells are kept.
        parallel: one cell on each core.
    """
    from rich.console import Console
    from tqdm import tqdm

    seeds = [BENCHMARK_SEEDS[0] + k for k in range(episodes)]
    started = time.monotonic()
    total = sum(work(cell) for cell in cells() + sweep())
    with tqdm(total=total, file=sys.stderr, bar_format="{l_bar}{bar}| {elapsed} < {remaining}") as bar:
        rows = measure(seeds, bar.update, folder, fresh, parallel)
    save(rows, seeds, time.monotonic() - started, output)
    # Wider than a pipe's 80 columns, which would cut the figures.
    console = Console(width=max(Console().width, 120))
    for part, meaning in PARTS.items():
        chosen = [row for row in rows if row.part == part and row.gain == 1.0]
        if chosen:
            console.print(energy_table.table(chosen, f"{part.capitalize()} part, {meaning}"))
    console.print("Regimes: " + "; ".join(f"{regime.name} = {regime.meaning}" for regime in REGIMES))
    console.print(f"Written to {output}: energy*, pareto*, breakdown.*, learning.*")
    return rows

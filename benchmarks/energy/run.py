"""Run of the energy benchmark: every controller in every regime; a report on the terminal, tables and figures."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from agents.evaluation.guest import Guest
from agents.evaluation.interquartile import center, interquartile_mean
from agents.evaluation.metrics import REGIMES, UNITS
from agents.evaluation.player import Player
from agents.evaluation.players import ELBOW_COUNTS
from agents.evaluation.regimes import BENCHMARK_SEEDS, SHIFTED, in_all_regimes
from agents.files import check_writable, write_text, write_whole
from agents.jobs.job import Job, Tell, counted
from agents.jobs.machines import Machines, do_all
from agents.machine import machine, versions
from agents.tasks import plain_arguments
from agents.workers import compile_before
from benchmarks import learning
from benchmarks.blocks import publish_blocks
from benchmarks.energy import breakdown, cache, effort, pareto, terminal
from benchmarks.energy import figures as energy_figure
from benchmarks.energy import markdown as energy_table
from benchmarks.energy.cache import Results
from benchmarks.energy.cells import PARTS, Cell, cells, guest_cells, own_arm_cells, players, sweep, work
from benchmarks.energy.rows import Row
from benchmarks.machine import CACHE, LATEST, PACKAGES, RESULTS
from benchmarks.optimal import Cell as Bound
from benchmarks.optimal import cached as cached_bound
from elbow_gym.task.settings import Settings

FEW = 3
"""Start poses of a short run. With both starts side by side they fit into one block of the kernel."""
LQR_ARMS = 80
"""Number of arms that the LQR moves side by side to find its gains: every state and voltage, up and down."""


@dataclass(frozen=True)
class Plan:
    """The extent of a run, and where the results of its cells are kept."""

    cells: Sequence[Cell]
    seeds: Sequence[int]
    """Seeds of the episodes."""
    every_seed: bool = True
    """Whether all training seeds of a learned controller play, or the best one."""
    folder: Path = CACHE
    fresh: bool = False
    """Whether to measure what was measured before, too."""


def plan(full: bool, episodes: int | None = None, **more: Any) -> Plan:
    """Plan of the full or the short benchmark with a number of start poses; `more` are further fields of `Plan`."""
    count = episodes if episodes is not None else len(BENCHMARK_SEEDS) if full else FEW
    if count < 1:
        raise ValueError(f"episodes must be positive, got {count}")
    seeds = [BENCHMARK_SEEDS[0] + k for k in range(count)]
    return Plan(cells() + sweep() if full else cells(["nominal"]), seeds, full, **more)


def bound(cell: Cell, regime: str) -> float | None:
    """The best known negative return from the start without noise; None where none was sought."""
    chosen = next(one for one in REGIMES if one.name == regime)
    if chosen.since > 0.0 or cell.part != "nominal" or not _of_the_bound(cell):
        return None
    figures = cached_bound(Bound(cell.elbows, chosen.start))
    return None if figures is None else float(figures["closed_loop"])


def _of_the_bound(cell: Cell) -> bool:
    """Whether a cell's players have the arm, the circle, the load and the reward that the bound is for."""
    if cell.guest is None:
        return not cell.arguments
    free = ("control_frequency", "timestep", "integrator", "voltage_limit", "action_unit", "start", "start_noise")
    own, papers = players(cell)[0].settings, Settings(elbows=cell.elbows)
    alike = replace(own, **{name: getattr(papers, name) for name in free})
    return plain_arguments(alike) == plain_arguments(papers)


def stored(cell: Cell, plan: Plan) -> list[Results] | None:
    """The results of a cell's players from an earlier run; None when one is missing, or all are wanted fresh."""
    if plan.fresh:
        return None
    found = []
    for player in players(cell, plan.every_seed):
        results = cache.load(_key(cell, player, plan), plan.folder) if player.identity else None
        if results is None:
            return None
        found.append(results)
    return found


def play(cell: Cell, plan: Plan, tell: Tell) -> list[Results]:
    """The results of a cell's players, each from the plan's folder where the same was measured before.

    `tell` is called with the units of work done, `work` in all when all is measured.
    """
    starts = len({regime.start for regime in cell.regimes})
    measured = []
    for player in players(cell, plan.every_seed):
        name = _key(cell, player, plan)
        results = None if plan.fresh or not player.identity else cache.load(name, plan.folder)
        if results is None:
            results = in_all_regimes(player, plan.seeds, counted(starts * player.work, tell), cell.regimes)
            if player.identity:
                cache.store(name, results, plan.folder)
        else:
            tell(starts * player.work)
        measured.append(results)
    return measured


def _key(cell: Cell, player: Player, plan: Plan) -> str:
    question = {
        "settings": plain_arguments(player.settings),
        "identity": player.identity,
        "seeds": list(plan.seeds),
        "regimes": [regime.name for regime in cell.regimes],
        "versions": versions("numpy", "numba", "scipy"),
    }
    return cache.key(json.loads(json.dumps(question)))


def rows_of(cell: Cell, measured: Sequence[Results], every_seed: bool = True) -> list[Row]:
    """A cell's rows from the results of its players."""
    seeds = [player.seed for player in players(cell, every_seed)]
    rows = []
    for regime in cell.regimes:
        values = {name: np.stack([results[regime.name][name] for results in measured]) for name in UNITS}
        joints = np.concatenate([results[regime.name]["joint_energy"] for results in measured])
        figures = {name: interquartile_mean(samples) for name, samples in values.items()}
        own = [
            {"seed": seed, **{name: center(values[name][k]) for name in UNITS}}
            for k, seed in enumerate(seeds)
            if seed is not None
        ]
        best = bound(cell, regime.name)
        rows.append(
            Row(
                cell.controller,
                cell.elbows,
                regime.name,
                figures,
                tuple(center(column) for column in joints.T),
                cell.part,
                cell.gain,
                tuple(own),
                None if best is None else (-figures["return"].value - best) / abs(best),
            )
        )
    return rows


def played_rows(cell: Cell, plan: Plan, tell: Tell) -> list[Row]:
    """A cell's rows, played where they were not before: the work of one process."""
    return rows_of(cell, play(cell, plan, tell), plan.every_seed)


def measure(plan: Plan, parallel: bool = True, machines: Machines | None = None) -> list[Row]:
    """The rows of all cells; those not played before are played with a bar, the kernel compiled, `parallel` or not."""
    from tqdm import tqdm

    before = {cell: found for cell in plan.cells if (found := stored(cell, plan)) is not None}
    todo = [cell for cell in plan.cells if cell not in before]
    rows = {cell: rows_of(cell, found, plan.every_seed) for cell, found in before.items()}
    if todo:
        compile_before(batches(todo, plan))
        total = sum(work(cell, plan.every_seed) for cell in todo)
        with tqdm(total=total, file=sys.stderr, bar_format="{l_bar}{bar}| {elapsed} < {remaining}") as bar:
            jobs = {cell: Job(partial(played_rows, cell, plan), work(cell, plan.every_seed)) for cell in todo}
            done = do_all(jobs, bar.update, machines) if parallel else {c: jobs[c].work(bar.update) for c in todo}
        rows.update(done)
    return [row for cell in plan.cells for row in rows[cell]]


def batches(todo: Sequence[Cell], plan: Plan) -> list[tuple[Any, int]]:
    """Environments that cells will need, with their number of arms, for `compile_before`."""
    found: list[tuple[Any, int]] = []
    for cell in todo:
        starts = len({regime.start for regime in cell.regimes})
        for player in players(cell, every_seed=False):
            found.append((player.settings, len(plan.seeds)))
            if player.starts_together and starts > 1:
                found.append((player.settings, starts * len(plan.seeds)))
            if player.name == "lqr":
                found.append((player.settings, LQR_ARMS))
            if effort.timed(cell):
                found.append((player.settings, 1))
    return found


def save(rows: Sequence[Row], plan: Plan, seconds: float, folder: Path, command: str = "") -> None:
    """Writes the tables, the figures and what made them, each file whole.

    energy.csv, .md, .png and .json of the nominal part; of a full run also energy_short.md and energy_brief.md for the
    READMEs, energy_shifted.*, energy_table.*, energy_seeds.csv, energy_joints.png, pareto.png, pareto_gains.csv,
    breakdown.* of the paper's PD, and learning.* where curves are there.
    """
    played = [row for row in rows if row.gain == 1.0]
    nominal = [row for row in played if row.part == "nominal"]
    for part in PARTS:
        chosen = [row for row in played if row.part == part]
        stem = "energy" if part == "nominal" else f"energy_{part}"
        if chosen:
            energy_table.write_rows(chosen, folder / f"{stem}.csv")
            write_text(folder / f"{stem}.md", energy_table.markdown(chosen))
    context = {
        "command": command,
        "made": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "seconds": round(seconds, 1),
        "seeds": list(plan.seeds),
        "shifted": SHIFTED,
        "machine": machine(),
        "versions": versions(*PACKAGES),
    }
    write_text(folder / "energy.json", json.dumps(context, indent=2) + "\n")
    write_whole(folder / "energy.png", lambda temporary: energy_figure.figure(nominal, temporary))
    if not plan.every_seed:
        return
    write_text(folder / "energy_short.md", energy_table.short(nominal))
    write_text(folder / "energy_brief.md", energy_table.brief(nominal))
    energy_table.write_seeds(played, folder / "energy_seeds.csv")
    write_whole(folder / "energy_joints.png", lambda temporary: energy_figure.joints(nominal, temporary))
    marks = pareto.marks([row for row in rows if row.part == "nominal"])
    write_whole(folder / "pareto.png", lambda temporary: pareto.figure(marks, temporary))
    pareto.write_gains(marks, folder / "pareto_gains.csv")
    papers = {(row.elbows, row.regime): row.joint_energy for row in nominal if row.controller == "pd_paper"}
    if papers:
        counts = list(dict.fromkeys(elbows for elbows, _ in papers))
        exact = partial(breakdown.stored_motions, plan.folder)
        breakdown.save(breakdown.breakdown(lambda elbows, regime: papers[elbows, regime], counts, exact), folder)
    learning.save(folder)


def energy(
    output: Path = LATEST,
    episodes: int | None = None,
    fresh: bool = False,
    full: bool = False,
    publish: bool = False,
    folder: Path = CACHE,
    parallel: bool = True,
    machines: Machines | None = None,
    command: str = "",
    guests: Sequence[Guest] = (),
    planners: Sequence[str] = (),
    elbows: int | None = None,
    arguments: Mapping[str, Any] | None = None,
) -> list[Row]:
    """Runs the comparison, writes the results and prints the report. Returns the rows.

    Args:
        output: folder for the results, unless they are published.
        episodes: start poses, one fixed seed each; all 20 of a full run and 3 of a short one when None.
        fresh: play what was played before, too.
        full: all parts and training seeds; otherwise the nominal part and the best training seed.
        publish: a full run whose results go to benchmarks/results, and their tables into the READMEs.
        folder: where results of single cells are kept.
        parallel: one cell on each core.
        machines: what plays the cells in place of this one's processes.
        command: the command line, for energy.json.
        guests: players of the user's own, which play the nominal part.
        planners: names of planners, which play it, too.
        elbows: the only elbow count that is compared; all when None.
        arguments: arguments of a user's own environment, the elbows among them, in which the classical controllers play
            instead of all players in the default one.

    Raises:
        ValueError: own players or an own environment would be published, or a guest plays nowhere.
    """
    started = time.monotonic()
    if publish and (guests or planners or arguments or elbows is not None):
        raise ValueError("--publish must be given without --with, --elbows, --arm and --environment")
    chosen = plan(full or publish, episodes, folder=folder, fresh=fresh)
    if arguments is not None:
        chosen = replace(chosen, cells=own_arm_cells(arguments, guests, planners), every_seed=False)
    else:
        counts = ELBOW_COUNTS if elbows is None else (elbows,)
        shown = [cell for cell in chosen.cells if elbows is None or cell.elbows == elbows]
        planned = [Cell(name, count) for name in planners for count in counts]
        chosen = replace(chosen, cells=[*shown, *planned, *guest_cells(guests, counts)])
    output = RESULTS if publish else output
    for place in (output, folder):
        check_writable(place)
    rows = measure(chosen, parallel, machines)
    save(rows, chosen, time.monotonic() - started, output, command)
    effort.save(chosen.cells, output / "effort.csv")
    changed = publish_blocks(output) if publish else []
    print(terminal.report(rows, len(chosen.seeds), chosen.every_seed, [output, *changed]))
    return rows

"""Run of the speed benchmark: this project and its peers in interleaved rounds; table, CSV, JSON and a figure."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from agents.files import write_csv, write_text, write_whole
from agents.machine import machine, versions
from agents.workers import COMPILE_SECONDS, compile_before, cores
from benchmarks.blocks import publish_blocks
from benchmarks.machine import LATEST_SPEED, PACKAGES, RESULTS
from benchmarks.speed import markdown
from benchmarks.speed.environments import environment_contenders
from benchmarks.speed.own import Contender, Sampler, compilations, own_contenders
from benchmarks.speed.peers import MUJOCO, check_agreement, peer_contenders
from benchmarks.speed.precision import TRUE_STEPS, Point, errors, methods, points, trials, truth
from benchmarks.speed.rows import RATIO, Row, ratios
from elbow_gym.task.settings import Settings

ROUNDS, SECONDS = 11, 0.1
QUICK_ROUNDS, QUICK_SECONDS = 3, 0.002


def contenders(quick: bool = False) -> list[Contender]:
    """All rows, in the table's order."""
    return own_contenders() + peer_contenders() + environment_contenders(quick)


def measure(
    chosen: Sequence[Contender], quick: bool, progress: Callable[[str, float], None]
) -> tuple[list[Row], dict[str, str]]:
    """Times all contenders in interleaved rounds, then those that want to be alone.

    Args:
        chosen: the contenders.
        quick: few and short samples.
        progress: called with the name of the work and the planned seconds done since its last call.

    Returns:
        The rows, and the families that were skipped (all or in part) with the reason.
    """
    rounds, seconds = (QUICK_ROUNDS, QUICK_SECONDS) if quick else (ROUNDS, SECONDS)
    samples: dict[int, list[float]] = {k: [] for k in range(len(chosen))}
    skipped: dict[str, str] = {}

    def prepare(k: int, stack: ExitStack) -> Sampler | None:
        try:
            return chosen[k].make(stack)
        except missing_library() as error:
            skipped.setdefault(chosen[k].family, str(error).splitlines()[0])
            return None

    def take(k: int, sampler: Sampler, length: float) -> None:
        samples[k].append(sampler(length))
        progress(f"{chosen[k].family}: {chosen[k].name}", planned(chosen[k], quick))

    together = [k for k, contender in enumerate(chosen) if contender.rounds is None]
    with ExitStack() as stack:
        ready: dict[int, Sampler] = {}
        for k in together:
            progress(f"preparing {chosen[k].name}", 0.0)
            sampler = prepare(k, stack)
            if sampler is not None:
                ready[k] = sampler
        for _ in range(rounds):
            for k, sampler in ready.items():
                take(k, sampler, planned(chosen[k], quick))
    for k, contender in enumerate(chosen):
        if contender.rounds is not None:
            with ExitStack() as stack:
                progress(f"{contender.family}: {contender.name}", 0.0)
                sampler = prepare(k, stack)
                for _ in range(1 if quick else contender.rounds):
                    if sampler is not None:
                        take(k, sampler, seconds)
    return [Row(chosen[k], tuple(found)) for k, found in samples.items() if found], skipped


def missing_library() -> tuple[type[Exception], ...]:
    """Errors that a missing optional library raises."""
    from gymnasium.error import DependencyNotInstalled

    return ImportError, DependencyNotInstalled


def planned(contender: Contender, quick: bool) -> float:
    """Approximate duration of one sample [s]."""
    if contender.rounds is None and quick:
        return QUICK_SECONDS
    return contender.seconds or SECONDS


def table(rows: Sequence[Row]) -> Any:
    """Table for the terminal."""
    from rich.table import Table

    header = markdown.HEADER
    title = f"Time per unit and arm: median and quartiles. Against MuJoCo's RK4 step: {markdown.EQUAL_COST}"
    body = Table(title=title)
    for name in header:
        body.add_column(name, justify="left" if name in header[:3] else "right", no_wrap=True)
    for k, (row, ratio) in enumerate(zip(rows, ratios(rows), strict=True)):
        ends = k + 1 == len(rows) or rows[k + 1].contender.family != row.contender.family
        body.add_row(*markdown.shown(row, ratio), end_section=ends)
    return body


def save(rows: Sequence[Row], found: Sequence[Point], context: dict[str, Any], folder: Path) -> None:
    """Writes the results, each file whole or not at all.

    speed.csv, speed.json, speed.md and speed.png; speed_brief.md and precision.md for a README; precision.csv and
    precision.png.
    """
    from benchmarks.speed.figure import figure, work_precision

    header = ["who", "what", "unit", "joints", "elbows", "arms", "threads", "clock"]
    header += ["median [us]", "lower quartile [us]", "upper quartile [us]", "samples", RATIO]
    body: list[list[Any]] = []
    for row, ratio in zip(rows, ratios(rows), strict=True):
        who, (low, median, high) = row.contender, row.quartiles
        cells = [who.family, who.name, who.unit, who.joints, who.elbows, who.arms, who.threads, who.clock]
        cells += [f"{1e6 * value:.6g}" for value in (median, low, high)]
        cells += [len(row.samples), None if ratio is None else f"{ratio:.4g}"]
        body.append(["" if cell is None else cell for cell in cells])
    write_csv(folder / "speed.csv", header, body)
    write_text(folder / "speed.json", json.dumps(context, indent=2) + "\n")
    write_text(folder / "speed.md", markdown.markdown(rows))
    write_text(folder / "speed_brief.md", markdown.brief(rows))
    write_whole(folder / "speed.png", lambda temporary: figure(rows, temporary))
    header = ["who", "integrator", "arms", "steps in a control period", "longest step [ms]", "CPU time [ms]"]
    header += ["median CPU time [ms]", "samples", "state error [-]", "energy error [-]"]
    body = [
        [point.trial.family, point.trial.integrator, point.trial.arms, point.trial.substeps]
        + [f"{1e3 * value:.6g}" for value in (point.trial.steps.max(), point.time, point.row.median)]
        + [len(point.row.samples), f"{point.state_error:.4g}", f"{point.energy_error:.4g}"]
        for point in found
    ]
    write_csv(folder / "precision.csv", header, body)
    write_text(folder / "precision.md", markdown.precision(methods(found)))
    write_whole(folder / "precision.png", lambda temporary: work_precision(methods(found), temporary))


def speed(output: Path = LATEST_SPEED, quick: bool = False, publish: bool = False, command: str = "") -> list[Row]:
    """Runs the comparison, prints the tables and writes the results. Returns the rows.

    Args:
        output: folder for the results, unless they are published.
        quick: take few and short samples, which show that everything runs; the times mean little then.
        publish: write the results to benchmarks/results, and their tables into the READMEs. ValueError if `quick`.
        command: the command line, for speed.json.
    """
    if quick and publish:
        raise ValueError("publish must be False for a quick run, whose times mean little, got True")
    from rich.console import Console
    from tqdm import tqdm

    started, load = time.monotonic(), os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    compile_before([(Settings(), 1), Settings()], dict.fromkeys(compilations(), COMPILE_SECONDS))
    differences = check_agreement()
    chosen, seconds = contenders(quick), {trial: trial.contender() for trial in trials(quick)}
    rounds, every = QUICK_ROUNDS if quick else ROUNDS, [*chosen, *seconds.values()]
    work = sum(planned(c, quick) * (rounds if c.rounds is None else 1 if quick else c.rounds) for c in every)
    # Counted in seconds of planned work, so that the time left is about right.
    form = "{desc:<60.60} {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"
    with tqdm(total=work, file=sys.stderr, bar_format=form) as bar:

        def progress(name: str, seconds: float) -> None:
            bar.set_description_str(name, refresh=False)
            bar.update(min(seconds, work - bar.n))

        rows, skipped = measure(chosen, quick, progress)
        timings, _ = measure(list(seconds.values()), quick, progress)
    found = points(list(seconds), timings)
    context = {
        "command": command,
        "made": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        "seconds": round(time.monotonic() - started, 1),
        "machine": {
            **machine(),
            "cores": cores(),
            "load_average_before": load,
        },
        "versions": versions(*PACKAGES, "mujoco", "pin", "imageio"),
        "rounds": rounds,
        "seconds_per_sample": QUICK_SECONDS if quick else SECONDS,
        "relative_difference_to_the_kernel": differences,
        "skipped": skipped,
        "precision": {
            "reference": f"exponential, {TRUE_STEPS} steps in a control period",
            "state and energy error of as many steps of rk4": errors(truth("rk4"), truth()),
        },
    }
    output = RESULTS if publish else output
    save(rows, found, context, output)
    changed = publish_blocks(output) if publish else []
    # Wider than a pipe's 80 columns, which would cut the figures.
    console = Console(width=max(Console().width, 190))
    console.print(table(rows))
    for family, reason in skipped.items():
        console.print(f"Skipped for want of a library: rows of {family} ({reason})", highlight=False)
    for case, difference in differences.items():
        soft = " (soft contacts)" if case.startswith(MUJOCO) and not case.endswith(" 0 elbows") else ""
        console.print(f"Accelerations against the kernel's, {case}: {difference:.1e}{soft}", highlight=False)
    console.print("Work and precision of a simulated second without elbows:")
    console.print(markdown.precision(methods(found)), highlight=False, markup=False)
    console.print(f"Written: {', '.join(map(str, [output, *changed]))}", highlight=False)
    return rows

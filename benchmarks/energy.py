"""`python -m benchmarks energy`: every controller in every regime, one table, CSV, JSON and a figure."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from agents.controller import Controller
from agents.evaluate import BENCHMARK_SEEDS, CLASSICAL, SHIFTED, in_all_regimes, named_controller
from agents.files import write_csv, write_text, write_whole
from agents.lqr import TimeVaryingLQR
from agents.metrics import REGIMES, UNITS, Regime
from agents.policy import shipped_seeds
from agents.style import CONTROLLER_COLOURS, CONTROLLER_NAMES, ELBOW_NAMES, pyplot
from agents.trajectory import Trajectory
from benchmarks import breakdown, pareto
from benchmarks.context import machine, versions
from benchmarks.optimal import RESULTS, Cell, cached, files
from benchmarks.statistics import Estimate, interquartile_mean
from elbow_gym.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

PACKAGES = ("elbow-gym", "gymnasium", "numpy", "numba", "scipy", "stable-baselines3", "torch")
ELBOW_COUNTS = (2, 1, 0)


@dataclass(frozen=True)
class Row:
    """One controller at one elbow count in one regime."""

    controller: str
    elbows: int
    regime: str
    figures: dict[str, Estimate]
    joint_energy: tuple[float, ...]
    """Interquartile mean of each joint's signed electrical energy [J]."""
    shifted: bool = False
    """Whether it is of the shifted set, for which no bound was sought."""


def cells() -> list[tuple[str, int]]:
    """Controller and elbow count of every comparison: the classical ones, and what a file is there for."""
    classical = [("pd_24v" if name == "pd" else name, elbows) for name in CLASSICAL for elbows in ELBOW_COUNTS]
    starts = {regime.start for regime in REGIMES}
    planned = [
        ("lqr", elbows) for elbows in ELBOW_COUNTS if all(files(Cell(elbows, start))[1].is_file() for start in starts)
    ]
    learned = [(name, elbows) for name in ("ppo", "sac") for elbows in ELBOW_COUNTS]
    learned = [(name, elbows) for name, elbows in learned if shipped_seeds(f"{name}_elbows{elbows}")]
    return classical + planned + learned


def contender(name: str, elbows: int) -> tuple[Settings, Callable[[ElbowArmVectorEnv], Controller]]:
    """The environment and the maker of a cell's controller."""
    if name != "lqr":
        return named_controller({"pd_24v": "pd"}.get(name, name), elbows)

    def follow(env: ElbowArmVectorEnv) -> TimeVaryingLQR:
        return TimeVaryingLQR(env, Trajectory.load(files(Cell(elbows, env.settings.start))[1]))

    return Settings(elbows=elbows), follow


def bound(elbows: int, regime: Regime) -> float | None:
    """The best known negative return of a regime, from the start without noise; None where none was sought."""
    figures = cached(Cell(elbows, regime.start)) if regime.since == 0.0 else None
    return None if figures is None else float(figures["closed_loop"])


def gap(row: Row) -> float | None:
    """The optimality gap (J - J_opt) / |J_opt| with J = -return, or None where there is no bound."""
    regime = next(regime for regime in REGIMES if regime.name == row.regime)
    best = None if row.shifted else bound(row.elbows, regime)
    return None if best is None else (-row.figures["return"].value - best) / abs(best)


def shifted_cells() -> list[tuple[str, int]]:
    """The cells that also play the shifted set: not the LQR, whose trajectory is of one circle, nor the 10 kHz PD."""
    return [(name, elbows) for name, elbows in cells() if name not in ("lqr", "pd_paper")]


def measure(seeds: Sequence[int], progress: Callable[[str, int], None]) -> list[Row]:
    """Runs all cells on the nominal set, then on the shifted one; `progress` gets a cell's name and the cells done."""
    rows: list[Row] = []
    everything = [(cell, False) for cell in cells()] + [(cell, True) for cell in shifted_cells()]
    for k, ((name, elbows), shifted) in enumerate(everything):
        progress(f"{name}, {ELBOW_NAMES[elbows]}{', shifted' if shifted else ''}", k)
        settings, make = contender(name, elbows)
        if shifted:
            settings = replace(settings, **SHIFTED)
        regimes = [regime for regime in REGIMES if not shifted or regime.start == "paper"]
        results = in_all_regimes(settings, make, seeds, regimes=regimes)
        for regime in regimes:
            values = results[regime.name]
            figures = {metric: interquartile_mean(values[metric]) for metric in UNITS}
            joints = tuple(interquartile_mean(column).value for column in values["joint_energy"].T)
            rows.append(Row(name, elbows, regime.name, figures, joints, shifted))
    progress("done", len(everything))
    return rows


HEADER = (
    "controller",
    "elbows",
    "regime",
    "energy (J)",
    "drawn (J)",
    "rms (mm)",
    "z rms (mm)",
    "return",
    "gap",
    "pull (N)",
    "below (s)",
)


def shown(row: Row, estimate: Callable[[Estimate], str]) -> tuple[str, ...]:
    """A row's cells under HEADER; `estimate` writes the figures that have an interval."""
    figures = row.figures
    force = figures["smallest_elbow_force"].value
    return (
        CONTROLLER_NAMES[row.controller],
        str(row.elbows),
        row.regime,
        estimate(figures["electrical_energy"]),
        f"{figures['drawn_energy'].value:.4g}",
        estimate(figures["error_rms"]),
        f"{figures['z_rms'].value:.3g}",
        f"{figures['return'].value:.4g}",
        "" if (share := gap(row)) is None else f"{100.0 * share:.3g} %",
        # Only a negative force is a pull on the table.
        f"{force:.1f}" if force < 0.0 else "-",
        f"{figures['below_table'].value:.2f}",
    )


def markdown(rows: Sequence[Row]) -> str:
    """The README's table, with 95 % intervals."""
    lines = [HEADER, ("---",) * len(HEADER)]
    lines += [shown(row, lambda e: f"{e.value:.4g} [{e.low:.4g}, {e.high:.4g}]") for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def table(rows: Sequence[Row], title: str) -> Any:
    """The same for the terminal, without the intervals."""
    from rich.table import Table

    body = Table(title=f"{title}: interquartile means over the evaluation episodes")
    for name in HEADER:
        body.add_column(name, justify="left" if name == "controller" else "right", no_wrap=name == "controller")
    for row, after in zip(rows, [*rows[1:], None], strict=True):
        last = after is None or (row.controller, row.elbows) != (after.controller, after.elbows)
        body.add_row(*shown(row, lambda e: f"{e.value:.4g}"), end_section=last)
    return body


def figure(rows: Sequence[Row], path: Path) -> None:
    """Energy and tracking error of every controller, by regime and elbow count, on logarithmic axes."""
    plt = pyplot()
    controllers = list(dict.fromkeys(row.controller for row in rows))
    fig, axes = plt.subplots(2, len(REGIMES), figsize=(10, 6), sharex=True, sharey="row", layout="constrained")
    panels = (("electrical_energy", "electrical energy (J)"), ("error_rms", "hand error, rms (mm)"))
    width = 0.8 / len(controllers)
    for column, regime in enumerate(REGIMES):
        axes[0, column].set_title(f"{regime.name}: {regime.meaning}", fontsize=9)
        for line, (metric, label) in enumerate(panels):
            ax = axes[line, column]
            for k, controller in enumerate(controllers):
                chosen = [row for row in rows if row.controller == controller and row.regime == regime.name]
                places = [ELBOW_COUNTS.index(row.elbows) + (k - (len(controllers) - 1) / 2) * width for row in chosen]
                estimates = [row.figures[metric] for row in chosen]
                values = [e.value for e in estimates]
                spread = [[e.value - e.low for e in estimates], [e.high - e.value for e in estimates]]
                colour, name = CONTROLLER_COLOURS[controller], CONTROLLER_NAMES[controller]
                ax.bar(places, values, width, yerr=spread, color=colour, label=name, error_kw={"lw": 1})
            ax.set_yscale("log")
            ax.grid(axis="x", visible=False)
            ax.set_xticks(range(len(ELBOW_COUNTS)), [ELBOW_NAMES[elbows] for elbows in ELBOW_COUNTS])
            if column == 0:
                ax.set_ylabel(label)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper center", ncols=min(5, len(controllers)))
    fig.savefig(path)
    plt.close(fig)


def marks(rows: Sequence[Row]) -> list[pareto.Mark]:
    """Every controller's place beside the front, in regime A."""
    places = []
    for row in rows:
        if row.regime == "A":
            energy = row.figures["electrical_energy"].value
            error = row.figures["error_mean"].value
            places.append(pareto.Mark(row.controller, row.elbows, error, energy))
    return places


def save(rows: Sequence[Row], seeds: Sequence[int], seconds: float, folder: Path) -> None:
    """Writes energy.csv, .json, .md and .png, pareto.png, and breakdown.csv and .md of the paper's PD, each whole.

    The shifted set's rows stand in energy_shifted.csv and .md.
    """
    nominal, shifted = split(rows)
    _write_rows(nominal, folder / "energy.csv")
    _write_rows(shifted, folder / "energy_shifted.csv")
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
    write_text(folder / "energy.md", markdown(nominal))
    write_text(folder / "energy_shifted.md", markdown(shifted))
    write_whole(folder / "energy.png", lambda temporary: figure(nominal, temporary))
    write_whole(folder / "pareto.png", lambda temporary: pareto.figure(marks(nominal), temporary))
    papers = {(row.elbows, row.regime): row.joint_energy for row in nominal if row.controller == "pd_paper"}
    if papers:
        counts = list(dict.fromkeys(elbows for elbows, _ in papers))
        breakdown.save(breakdown.breakdown(lambda elbows, regime: papers[elbows, regime], counts), folder)


def split(rows: Sequence[Row]) -> tuple[list[Row], list[Row]]:
    """Rows of the nominal and of the shifted set."""
    return [row for row in rows if not row.shifted], [row for row in rows if row.shifted]


def _write_rows(rows: Sequence[Row], path: Path) -> None:
    if not rows:
        return
    header = ["controller", "elbows", "regime"]
    header += [f"{name} [{unit}]{part}" for name, unit in UNITS.items() for part in ("", " low", " high")]
    joints = max(len(row.joint_energy) for row in rows)
    header += [f"electrical_energy_joint_{k + 1} [J]" for k in range(joints)]
    header.append("optimality_gap [-]")
    body = [
        [row.controller, row.elbows, row.regime]
        + [f"{value:.6g}" for name in UNITS for value in row.figures[name]]
        + [f"{value:.6g}" for value in row.joint_energy]
        + ["" if (share := gap(row)) is None else f"{share:.6g}"]
        for row in rows
    ]
    write_csv(path, header, body)


def energy(output: Path = RESULTS, episodes: int = len(BENCHMARK_SEEDS)) -> list[Row]:
    """Runs the comparison, prints the table and writes the results. Returns the rows."""
    from rich.console import Console
    from tqdm import tqdm

    seeds = [BENCHMARK_SEEDS[0] + k for k in range(episodes)]
    started = time.monotonic()
    with tqdm(total=len(cells()) + len(shifted_cells()), file=sys.stderr, unit="controller") as bar:

        def progress(name: str, done: int) -> None:
            bar.set_description(name)
            bar.update(done - bar.n)

        rows = measure(seeds, progress)
    save(rows, seeds, time.monotonic() - started, output)
    # Wider than a pipe's 80 columns, which would cut the figures.
    console = Console(width=max(Console().width, 110))
    nominal, shifted = split(rows)
    console.print(table(nominal, "Nominal set"))
    if shifted:
        console.print(table(shifted, "Shifted set"))
    console.print("Regimes: " + "; ".join(f"{regime.name} = {regime.meaning}" for regime in REGIMES))
    console.print(f"Written to {output}: energy.*, energy_shifted.*, pareto.png, breakdown.*")
    return rows

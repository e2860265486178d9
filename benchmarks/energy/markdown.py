"""The energy benchmark's rows as Markdown, CSV and a table on the terminal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.evaluation.metrics import UNITS
from agents.files import write_csv
from agents.style import CONTROLLER_NAMES
from benchmarks.energy.statistics import Estimate

if TYPE_CHECKING:
    from benchmarks.energy.rows import Row

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
    "seeds",
)


BRIEF_HEADER = (
    "elbows",
    "controller",
    "return, A",
    "gap, A",
    "energy, A (J)",
    "energy, B (J)",
    "rms, B (mm)",
    "energy, C (J)",
    "seeds",
)


def shown(row: Row, estimate: Callable[[Estimate], str]) -> tuple[str, ...]:
    """A row's cells under HEADER; `estimate` writes the figures that have an interval."""
    figures = row.figures
    force = figures["smallest_elbow_force"].value
    return (
        CONTROLLER_NAMES.get(row.controller, row.controller),
        str(row.elbows),
        row.regime,
        estimate(figures["electrical_energy"]),
        f"{figures['drawn_energy'].value:.4g}",
        estimate(figures["error_rms"]),
        f"{figures['z_rms'].value:.3g}",
        f"{figures['return'].value:.4g}",
        "" if row.gap is None else f"{100.0 * row.gap:.3g} %",
        # Only a negative force is a pull on the table.
        f"{force:.1f}" if force < 0.0 else "-",
        f"{figures['below_table'].value:.2f}",
        str(len(row.seeds)) if row.seeds else "-",
    )


def with_interval(estimate: Estimate) -> str:
    """A figure with its 95 % interval."""
    return f"{estimate.value:.4g} [{estimate.low:.4g}, {estimate.high:.4g}]"


def markdown(rows: Sequence[Row]) -> str:
    """Every row, with 95 % intervals."""
    return _pipes([HEADER, *(shown(row, with_interval) for row in rows)])


def brief(rows: Sequence[Row]) -> str:
    """The README's table: a line per elbow count and controller, the regimes side by side, the best return first."""
    regimes: dict[tuple[int, str], dict[str, Row]] = {}
    for row in rows:
        regimes.setdefault((row.elbows, row.controller), {})[row.regime] = row

    def merit(key: tuple[int, str]) -> tuple[int, float]:
        return -key[0], -regimes[key]["A"].figures["return"].value

    lines: list[tuple[str, ...]] = [BRIEF_HEADER]
    for key in sorted(regimes, key=merit):
        whole, steady, on_target = (regimes[key][name] for name in "ABC")
        lines.append(
            (
                str(key[0]),
                CONTROLLER_NAMES.get(key[1], key[1]),
                with_interval(whole.figures["return"]),
                "" if whole.gap is None else f"{100.0 * whole.gap:.3g} %",
                with_interval(whole.figures["electrical_energy"]),
                f"{steady.figures['electrical_energy'].value:.4g}",
                with_interval(steady.figures["error_rms"]),
                f"{on_target.figures['electrical_energy'].value:.4g}",
                str(len(whole.seeds)) if whole.seeds else "-",
            )
        )
    return _pipes(lines)


def _pipes(lines: Sequence[tuple[str, ...]]) -> str:
    rule = ("---",) * len(lines[0])
    return "".join(f"| {' | '.join(line)} |\n" for line in (lines[0], rule, *lines[1:]))


def table(rows: Sequence[Row], title: str) -> Any:
    """The same for the terminal, without the intervals."""
    from rich.table import Table

    body = Table(title=f"{title}: interquartile means over training seeds and episodes")
    for name in HEADER:
        body.add_column(name, justify="left" if name == "controller" else "right", no_wrap=name == "controller")
    for row, after in zip(rows, [*rows[1:], None], strict=True):
        last = after is None or (row.controller, row.elbows) != (after.controller, after.elbows)
        body.add_row(*shown(row, lambda e: f"{e.value:.4g}"), end_section=last)
    return body


def write_rows(rows: Sequence[Row], path: Path) -> None:
    """Writes every figure with its interval, and the energy of every joint."""
    header = ["controller", "elbows", "regime"]
    header += [f"{name} [{unit}]{part}" for name, unit in UNITS.items() for part in ("", " low", " high")]
    joints = max(len(row.joint_energy) for row in rows)
    header += [f"electrical_energy_joint_{k + 1} [J]" for k in range(joints)]
    header += ["optimality_gap [-]", "training_seeds [-]"]
    body = [
        [row.controller, row.elbows, row.regime]
        + [f"{value:.6g}" for name in UNITS for value in row.figures[name]]
        + [f"{value:.6g}" for value in row.joint_energy]
        + ["" if row.gap is None else f"{row.gap:.6g}", len(row.seeds)]
        for row in rows
    ]
    write_csv(path, header, body)


def write_seeds(rows: Sequence[Row], path: Path) -> None:
    """Writes each training seed's interquartile means over its episodes."""
    header = ["controller", "elbows", "part", "regime", "seed", *(f"{name} [{unit}]" for name, unit in UNITS.items())]
    body = [
        [row.controller, row.elbows, row.part, row.regime, int(own["seed"]), *(f"{own[name]:.6g}" for name in UNITS)]
        for row in rows
        for own in row.seeds
    ]
    write_csv(path, header, body)

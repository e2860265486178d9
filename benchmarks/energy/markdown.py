"""The energy benchmark's rows as Markdown and CSV."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from agents.evaluation.interquartile import Estimate
from agents.evaluation.metrics import UNITS
from agents.files import write_csv
from agents.style import elbow_name, look
from benchmarks.energy.cells import featured

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


def significant(value: float, digits: int = 3) -> str:
    """A number to so many significant digits, without an exponent."""
    rounded = float(f"{value:.{digits}g}")
    if rounded == 0.0 or not math.isfinite(rounded):
        return f"{rounded:g}"
    return f"{rounded:.{max(0, digits - 1 - math.floor(math.log10(abs(rounded))))}f}"


def percent(share: float) -> str:
    """A share in percent, to three significant digits."""
    return f"{significant(100.0 * share)} %"


def by_player(rows: Sequence[Row]) -> dict[tuple[int, str], dict[str, Row]]:
    """Rows of one part by regime, under elbow count and controller: most elbows first, then the best return in A."""
    regimes: dict[tuple[int, str], dict[str, Row]] = {}
    for row in rows:
        regimes.setdefault((row.elbows, row.controller), {})[row.regime] = row
    return dict(sorted(regimes.items(), key=lambda item: (-item[0][0], -item[1]["A"].figures["return"].value)))


def shown(row: Row) -> tuple[str, ...]:
    """A row's cells under HEADER."""
    figures = row.figures
    force = figures["smallest_elbow_force"].value
    return (
        look(row.controller)[0],
        str(row.elbows),
        row.regime,
        with_interval(figures["electrical_energy"]),
        significant(figures["drawn_energy"].value, 4),
        with_interval(figures["error_rms"]),
        significant(figures["z_rms"].value),
        significant(figures["return"].value, 4),
        "" if row.gap is None else percent(row.gap),
        # Only a negative force is a pull on the table.
        f"{force:.1f}" if force < 0.0 else "-",
        f"{figures['below_table'].value:.2f}",
        str(len(row.seeds)) if row.seeds else "-",
    )


def with_interval(estimate: Estimate) -> str:
    """Estimate with its 95 % interval."""
    value, low, high = (significant(number, 4) for number in estimate)
    return f"{value} [{low}, {high}]"


def markdown(rows: Sequence[Row]) -> str:
    """Every row, with 95 % intervals."""
    return pipes([HEADER, *(shown(row) for row in rows)])


def brief(rows: Sequence[Row]) -> str:
    """A line per elbow count and controller, the regimes side by side, the best return first."""
    lines: list[tuple[str, ...]] = [BRIEF_HEADER]
    for key, regimes in by_player(rows).items():
        whole, steady, on_target = (regimes[name] for name in "ABC")
        lines.append(
            (
                str(key[0]),
                look(key[1])[0],
                with_interval(whole.figures["return"]),
                "" if whole.gap is None else percent(whole.gap),
                with_interval(whole.figures["electrical_energy"]),
                significant(steady.figures["electrical_energy"].value, 4),
                with_interval(steady.figures["error_rms"]),
                significant(on_target.figures["electrical_energy"].value, 4),
                str(len(whole.seeds)) if whole.seeds else "-",
            )
        )
    return pipes(lines)


def short(rows: Sequence[Row]) -> str:
    """A line for each `featured` controller, the best return with most elbows first: regime A at every elbow count."""
    places = by_player([row for row in rows if featured(row.controller)])
    counts = list(dict.fromkeys(elbows for elbows, _ in places))
    header = ["controller", *(f"energy A, {elbow_name(elbows)} (J)" for elbows in counts)]
    header += [*(f"gap A, {elbow_name(elbows)}" for elbows in counts), f"error B, {elbow_name(counts[0])} (mm)"]
    lines = [tuple(header)]
    for controller in (name for elbows, name in places if elbows == counts[0]):
        of = [places[elbows, controller] for elbows in counts if (elbows, controller) in places]
        energies = [significant(regimes["A"].figures["electrical_energy"].value) for regimes in of]
        gaps = ["" if regimes["A"].gap is None else percent(regimes["A"].gap) for regimes in of]
        error = significant(of[0]["B"].figures["error_rms"].value)
        lines.append((look(controller)[0], *energies, *gaps, error))
    return pipes(lines)


def pipes(lines: Sequence[tuple[str, ...]]) -> str:
    """Lines of cells as a Markdown table, the first its header."""
    rule = ("---",) * len(lines[0])
    return "".join(f"| {' | '.join(line)} |\n" for line in (lines[0], rule, *lines[1:]))


def write_rows(rows: Sequence[Row], path: Path) -> None:
    """Writes every metric with its interval, and the energy of every joint."""
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

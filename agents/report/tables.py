"""Tables and sentences of the page as HTML, readable without the script, which only sorts and filters them."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

from agents.evaluation.players import TABLE
from agents.paper.cases import case_numbers
from agents.paper.claims import Numbers, disclosures, verdict
from agents.paper.numbers import PUBLISHED_CASES, quantities
from agents.report.payload import BEARINGS
from agents.report.runs import Run
from agents.style import CONTROLLER_NAMES, ELBOW_NAMES, look

PARTS = {"nominal": "energy", "shifted": "energy_shifted", TABLE: "energy_table"}
"""Parts of the benchmark and the files of their results."""
LEARNED = ("ppo", "sac")
PAPER_RUNS = {"paper": ("pd_paper", "paper"), "on target": ("pd_paper", "on_target"), "24 V": ("pd", "paper")}
"""Controller and start of `agents.paper.cases.RUNS`."""


class Column(NamedTuple):
    """A column of the benchmark's table."""

    name: str
    """Name in the CSV, without unit."""
    title: str
    meaning: str


COLUMNS = (
    Column("electrical_energy", "energy", "signed electrical energy"),
    Column("drawn_energy", "drawn", "electrical energy without what flows back"),
    Column("error_mean", "mean error", "mean distance of the hand from the target"),
    Column("error_rms", "rms error", "root mean square distance of the hand from the target"),
    Column("z_rms", "rms z", "its vertical part"),
    Column("return", "return", "sum of the rewards, tracking and energy together"),
    Column("optimality_gap", "gap", "distance from the best known return"),
    Column("smallest_elbow_force", "least force", "smallest force of the table on an elbow; negative: the table pulls"),
    Column("below_table", "below", "time that a joint or the hand spends under the table"),
)


def paper_numbers(runs: Sequence[Run]) -> dict[int, Numbers]:
    """The paper's numbers by elbow count, of the counts whose three runs are all there."""
    measured = {(run.controller, run.start, run.bearing): run.measured for run in runs}
    found = {}
    for elbows in PUBLISHED_CASES:
        cases = {name: measured.get((*key, str(elbows))) for name, key in PAPER_RUNS.items()}
        complete = {name: values for name, values in cases.items() if values is not None}
        if len(complete) == len(cases):
            found[elbows] = case_numbers(complete)
    return found


def headline(numbers: Mapping[int, Numbers], runs: Sequence[Run]) -> str:
    """Tiles on what bracing and learning change."""
    tiles = [
        (
            f"PD, {ELBOW_NAMES[elbows]}",
            one.energy_tracking,
            one.error_rms,
            f"pd_paper-{elbows}-paper",
            f"bearing-{elbows}",
        )
        for elbows, one in numbers.items()
    ]
    best = [run for run in runs if run.controller in LEARNED and run.start == "paper" and run.bearing == "2"]
    if best:
        run = max(best, key=lambda run: run.figures["A"]["return"])
        name = f"{CONTROLLER_NAMES[run.controller].split(',')[0]}, {BEARINGS[run.bearing]}"
        late = run.figures["B"]
        tiles.append((name, late["electrical_energy"], late["error_rms"], run.key, f"controller-{run.controller}"))
    return "".join(
        f'<li style="--mark: var(--{colour})"><button type="button" data-run="{key}"><strong>{energy:.4g} J</strong> '
        f"<span>{escape(name)}</span> <small>{error:.3g} mm rms error</small></button></li>\n"
        for name, energy, error, key, colour in tiles
    )


def claims(numbers: Mapping[int, Numbers]) -> str:
    """The paper's claims with their verdicts, and what should be known beside them."""
    if len(numbers) < len(PUBLISHED_CASES):
        return "<p>The verdicts need the paper's three cases; not all of their runs are in this file.</p>"
    judged = "".join(
        f'<li><p><strong class="{"holds" if claim.holds else "fails"}">{"Holds" if claim.holds else "Fails"}</strong> '
        f"{escape(claim.statement)}</p><p class=evidence>{escape(claim.evidence)}.</p></li>\n"
        for claim in verdict(numbers)
    )
    beside = "".join(f"<li>{escape(note)}</li>\n" for note in disclosures(numbers))
    return f"<ol class=claims>\n{judged}</ol>\n<p>To be known beside it:</p>\n<ul>\n{beside}</ul>"


def paper_table(numbers: Mapping[int, Numbers]) -> str:
    """Every number of the paper's cases beside the published one."""
    head = "".join(f"<th scope=col>{ELBOW_NAMES[elbows]}</th><th scope=col>published</th>" for elbows in numbers)
    listed = quantities(numbers) if numbers else {}
    body = ""
    for row in zip(*listed.values(), strict=True):
        cells = "".join(f"<td>{_number(one.value)}</td><td>{_number(one.expected)}</td>" for one in row)
        body += f"<tr><th scope=row>{escape(row[0].name.replace('_', ' '))} [{row[0].unit}]</th>{cells}</tr>\n"
    return f"<table><thead><tr><th scope=col>quantity</th>{head}</tr></thead>\n<tbody>\n{body}</tbody></table>"


def benchmark_table(results: Path, runs: Sequence[Run]) -> str:
    """The rows of energy.csv and energy_shifted.csv, each controller's name a button that shows its run."""
    parts = {part: _rows(results / f"{file}.csv") for part, file in PARTS.items()}
    if not parts["nominal"]:
        return "<p>There are no results: <code>python -m benchmarks energy</code> makes them.</p>"
    # "name [unit]"; beside it are "name [unit] low" and "... high".
    titled = [name[:-1].split(" [") for name in parts["nominal"][0] if name.endswith("]")]
    units = dict(titled)
    shown = [column for column in COLUMNS if column.name in units]
    head = "".join(
        f'<th scope=col data-sort><button type="button" title="{escape(column.meaning)}">{column.title}'
        f"{'' if units[column.name] == '-' else f' [{units[column.name]}]'}</button></th>"
        for column in shown
    )
    for name in ("regime", "leans on", "controller"):
        head = f'<th scope=col data-sort><button type="button">{name}</button></th>{head}'
    starts = {regime: run.start for run in runs for regime in run.figures}
    keys = {run.key for run in runs}
    body = ""
    columns = [(column.name, units[column.name]) for column in shown]
    for part, rows in parts.items():
        for row in rows:
            bearing = TABLE if part == TABLE else row["elbows"]
            key = f"{row['controller']}-{bearing}-{starts.get(row['regime'])}"
            body += _row(row, part, bearing, key if key in keys else None, columns)
    for run in (run for run in runs if run.label):
        for regime, figures in run.figures.items():
            own = {"controller": run.controller, "label": run.label, "regime": regime}
            own |= {f"{name} [{unit}]": f"{figures[name]:.6g}" for name, unit in columns if name in figures}
            body += _row(own, "nominal", run.bearing, run.key, columns)
    return f"<table id=benchmark-table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table>"


def _rows(path: Path) -> list[dict[str, str]]:
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as handle:
        return list(csv.DictReader(handle))


def _row(row: Mapping[str, str], part: str, bearing: str, key: str | None, columns: Sequence[tuple[str, str]]) -> str:
    name = escape(row.get("label") or look(row["controller"])[0])
    label = name if key is None else f'<button type="button" data-run="{key}">{name}</button>'
    cells = f"<td>{'table' if bearing == TABLE else escape(bearing)}</td><td>{escape(row['regime'])}</td>"
    for column, unit in columns:
        value = row.get(f"{column} [{unit}]", "")
        low, high = (row.get(f"{column} [{unit}] {end}", "") for end in ("low", "high"))
        interval = f' title="95 % interval {float(low):.4g} to {float(high):.4g}"' if low and high else ""
        number = float(value) if value not in ("", "nan") else None
        cells += f'<td data-value="{"" if number is None else value}"{interval}>{_number(number)}</td>'
    tags = f'data-set="{part}" data-regime="{escape(row["regime"])}" data-bearing="{escape(bearing)}"'
    tags += f' data-controller="{escape(row["controller"])}"'
    tags += f' data-error="{row.get("error_mean [mm]", "")}" data-energy="{row.get("electrical_energy [J]", "")}"'
    return f"<tr {tags}><th scope=row>{label}</th>{cells}</tr>\n"


def _number(value: float | None) -> str:
    """Four digits, a real minus sign; a dash where there is none."""
    if value is None:
        return "\N{EN DASH}"
    text = f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.4g}"
    return text.replace("-", "\N{MINUS SIGN}")

"""Verdict on whether leaning saves energy on a table that cannot pull, with the numbers and the command."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from agents.files import check_writable, write_csv, write_text, write_whole
from agents.paper.cases import RESULTS, check_publishable, settings_of
from agents.paper.claims import NUMBER_WORDS, Claim
from agents.paper.subject import Subject
from agents.paper.table_cases import (
    CLEAR,
    FRICTIONS,
    TableNumbers,
    TableRecording,
    lifts,
    measure_on_table,
    play_on_table,
    start_pose,
)
from agents.paper.table_figure import table_figure

Cases = Mapping[float, Mapping[str, TableNumbers]]
"""Numbers by friction, then by start, one of `table_cases.lifts`, most leaning joints first."""


@dataclass(frozen=True)
class TableReproduction:
    """Results of `reproduce_on_table` and the files that it wrote."""

    numbers: Cases
    claims: list[Claim]
    output: Path


def reproduce_on_table(
    output: Path = Path("reproduction"), publish: bool = False, subject: Subject | None = None
) -> TableReproduction:
    """Runs the paper's PD from each start under each friction, prints numbers and verdict and writes them.

    Args:
        output: folder for table_cases.png, table_numbers.csv and table_verdict.md.
        publish: also refresh the picture and the numbers in agents/paper/results.
        subject: arm and elbows, which are the joints that lean; the paper's when None.

    Raises:
        ValueError: results of another arm or other elbows than the paper's would be published, or the arm cannot lean
            on its elbows, be lifted off them or follow a circle.
    """
    from rich.console import Console
    from rich.markdown import Markdown
    from tqdm import tqdm

    subject = subject or Subject()
    check_publishable(publish, subject)
    check_writable(output)
    settings = settings_of(0, "paper", subject=subject)
    starts = lifts(subject)
    poses = [start_pose(subject.arm, subject.elbow_joints, lift) for lift in starts.values()]
    runs: dict[float, TableRecording] = {}
    layout = "{desc} {percentage:3.0f}%|{bar}| {elapsed} elapsed, {remaining} left"
    with tqdm(total=len(FRICTIONS) * settings.horizon, bar_format=layout) as bar:
        for friction in FRICTIONS:
            bar.set_description(f"friction {friction:g}")
            runs[friction] = play_on_table(poses, {"friction": friction}, settings, bar.update)
    cases = {
        friction: dict(zip(starts, measure_on_table(run, subject.elbow_joints), strict=True))
        for friction, run in runs.items()
    }
    text = table_markdown(cases, None if subject.published else subject.described())
    files = [
        write_whole(output / "table_cases.png", table_figure(runs, cases).savefig),
        write_table_numbers(output / "table_numbers.csv", cases),
        write_text(output / "table_verdict.md", text),
    ]
    if publish:
        picture = files[0].read_bytes()
        files.append(write_whole(RESULTS / "table_cases.png", lambda temporary: temporary.write_bytes(picture)))
        files.append(write_table_numbers(RESULTS / "table_numbers.csv", cases))
    console = Console()
    console.print(terminal_table(cases))
    console.print(Markdown(text))
    console.print("Wrote " + ", ".join(str(path) for path in files))
    return TableReproduction(cases, table_verdict(cases), output)


def table_verdict(cases: Cases) -> list[Claim]:
    """Whether leaning on the table saves energy, for each friction; nothing here knows the answer."""
    return [_saving(friction, starts) for friction, starts in cases.items()]


def _saving(friction: float, starts: Mapping[str, TableNumbers]) -> Claim:
    each = list(starts.values())
    whole, late = [n.energy for n in each], [n.energy_tracking for n in each]
    saved = "; ".join(
        f"{name}: {1.0 - n.energy_tracking / late[-1]:.1%}" for name, n in starts.items() if name != CLEAR
    )
    return Claim(
        f"friction {friction:g}",
        "The more joints lean on the table, the less energy the arm takes, in the whole run and from 2 s on.",
        all(less < more for values in (whole, late) for less, more in pairwise(values)),
        f"energy for t > 2 s {_listed(late, 'J')}, of which leaning saves ({saved}); whole run "
        f"{_listed(whole, 'J')}; hand error rms {_listed([n.error_rms for n in each], 'mm')}; leaning on "
        f"{next(iter(starts))}, windings turn {each[0].copper_loss_tracking:.3g} J into heat for t > 2 s, contacts "
        f"{each[0].contact_loss_tracking:.2g} J",
    )


def _listed(values: list[float], unit: str) -> str:
    return " / ".join(f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.3g}" for value in values) + f" {unit}"


def _loads(cases: Cases) -> Iterator[str]:
    """Sentences on the forces that the table bears from each start, a value per friction."""
    for start, first in next(iter(cases.values())).items():
        numbers = [starts[start] for starts in cases.values()]
        forces = {f"joint {joint} for t > 2 s": [n.force[joint].mean for n in numbers] for joint in first.force}
        forces["any other point, at most"] = [n.force_elsewhere_largest for n in numbers]
        borne = (f"{name} {_listed(values, 'N')}" for name, values in forces.items() if max(values) > 0.0)
        yield f"Start {start}: {'; '.join(borne) or 'nothing'}."


def table_markdown(cases: Cases, other: str | None = None) -> str:
    """Verdict and loads as a Markdown document.

    Args:
        cases: the numbers that decide.
        other: description of the arm where it is not the paper's on the paper's elbows.
    """
    starts = next(iter(cases.values()))
    number = NUMBER_WORDS.get(len(starts), str(len(starts))).capitalize()
    lines = [
        "# Does leaning save energy on a table that cannot pull?",
        "",
        *([] if other is None else [f"Arm: {other}, under the paper's PD and its gains.", ""]),
        f"{number} values stand for the starts " + " / ".join(starts) + ". Every verdict is computed from the run.",
        "",
    ]
    for number, claim in enumerate(table_verdict(cases), start=1):
        holds = "Holds" if claim.holds else "FAILS" if other is None else "Does not hold here"
        lines += [f"{number}. **{holds}** ({claim.name}). {claim.statement}", "", f"   Evidence: {claim.evidence}.", ""]
    return "\n".join(
        [
            *lines,
            "What the table bears, under friction " + " / ".join(f"{friction:g}" for friction in cases) + ":",
            "",
            *(f"- {line}" for line in _loads(cases)),
            "",
        ]
    )


def _unit(name: str) -> str:
    return "N" if name.startswith("force") else "mm" if name.endswith("rms") else "J"


def write_table_numbers(path: Path, cases: Cases) -> Path:
    """Writes a CSV row per friction and start: every number of `TableNumbers`."""
    names = _names(cases)
    header = ["friction [-]", "start", *(f"{name} [{_unit(name)}]" for name in names)]
    rows = [
        [f"{friction:g}", start, *(f"{value:.6g}" for value in numbers.columns.values())]
        for friction, starts in cases.items()
        for start, numbers in starts.items()
    ]
    return write_csv(path, header, rows)


def _names(cases: Cases) -> list[str]:
    """Names of the numbers, the same for every start and friction."""
    return list(next(iter(next(iter(cases.values())).values())).columns)


def terminal_table(cases: Cases) -> Any:
    """The numbers for the terminal, a row each, a column per friction and start."""
    from rich.box import SIMPLE
    from rich.markup import escape
    from rich.table import Table

    table = Table(
        title="The paper's PD on a table that cannot pull",
        box=SIMPLE,
        caption="Tracking, errors and forces on leaning joints: t > 2 s; forces elsewhere: whole run.",
    )
    table.add_column("", no_wrap=True)
    columns = [(friction, start) for friction, starts in cases.items() for start in starts]
    for friction, start in columns:
        table.add_column(f"{start}\nfriction {friction:g}", justify="right")
    for name in _names(cases):
        values = (cases[friction][start].columns[name] for friction, start in columns)
        table.add_row(escape(f"{name} [{_unit(name)}]".replace("_", " ")), *(f"{value:.4g}" for value in values))
    return table

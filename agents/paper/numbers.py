"""Numbers of the paper's cases beside the published ones, as a CSV file and for the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

from agents.files import write_csv
from agents.paper.claims import Numbers
from agents.style import elbow_name

PUBLISHED_CASES = (2, 1, 0)
"""Numbers of elbows of the paper's cases, in the order of its numbers."""

EXPECTED: dict[str, tuple[Any, Any, Any]] = {
    "energy": (7660.0, 8726.0, 10866.0),
    "energy_tracking": (51.7, 625.5, 1770.0),
    "link_work": (4.75, 4.51, 4.03),
    "error_rms": (12.6, 86.2, 198.2),
    "z_rms": (12.0, 85.1, 196.6),
    "energy_on_target": (96.2, 1097.0, 3139.0),
    "energy_clipped": (806.0, 1825.0, 3852.0),
    "force_mean": ((-1.3, None), (None,), ()),
    "force_smallest": ((-7.9, None), (None,), ()),
    "joint_energy": (
        (7491.0, 3.0, 11.8, 6.6, 1.9, 15.8, 94.5, 25.0, 6.9, 3.7),
        (7490.0, 19.5, 77.8, 582.0, 307.0, 126.0, 89.0, 24.7, 6.5, 3.7),
        (7487.0, 1372.0, 850.0, 590.0, 313.0, 129.0, 89.0, 25.0, 6.4, 3.7),
    ),
}
"""Published reference of `PUBLISHED_CASES` by field of `Numbers`: the PD continuous inside RK4 at 1e-4 s.

Rounded as published. Here each voltage is held for 1e-4 s, which makes the start of joint 1 cost 0.2 % more.
"""

UNITS = {"error_rms": "mm", "z_rms": "mm", "z_mean": "mm", "force_mean": "N", "force_smallest": "N", "below_table": "s"}
"""Units of the fields of `Numbers`; J where none is given."""


class Quantity(NamedTuple):
    """A number of one case beside the published one; None where there is none."""

    name: str
    unit: str
    value: float | None
    expected: float | None

    @property
    def difference(self) -> float | None:
        """Difference from the published value, relative to it [-]."""
        if self.value is None or self.expected is None:
            return None
        return self.value / self.expected - 1.0


def quantities(cases: Mapping[int, Numbers], published: bool = True) -> dict[int, list[Quantity]]:
    """Every number of each case, the same list for every case.

    Args:
        cases: numbers by elbow count.
        published: whether they are the paper's arm's, which has published numbers.
    """
    elbow_joints = cases[max(cases)].elbow_joints
    return {elbows: _of_case(elbows, numbers, elbow_joints, published) for elbows, numbers in cases.items()}


def _of_case(elbows: int, numbers: Numbers, elbow_joints: Sequence[int], published: bool) -> list[Quantity]:
    listed = []
    for name, value in asdict(numbers).items():
        if name == "elbow_joints":
            continue
        unit = UNITS.get(name, "J")
        expected = EXPECTED[name][PUBLISHED_CASES.index(elbows)] if published and name in EXPECTED else None
        if not isinstance(value, tuple):
            listed.append(Quantity(name, unit, value, expected))
            continue
        joints = range(1, len(value) + 1) if name == "joint_energy" else numbers.elbow_joints
        known = [None] * len(value) if expected is None else expected
        found = dict(zip(joints, zip(value, known, strict=True), strict=True))
        everywhere = joints if name == "joint_energy" else elbow_joints
        listed += [Quantity(f"{name}_{joint}", unit, *found.get(joint, (None, None))) for joint in everywhere]
    return listed


def write_numbers(path: Path, cases: Mapping[int, Numbers], published: bool = True) -> Path:
    """Writes a CSV row per case: every quantity, its published value and the relative difference, empty where none.

    See `quantities` for the arguments; of another arm the columns of published values are left out.
    """
    table = quantities(cases, published)
    compared = {quantity.name for listed in table.values() for quantity in listed if quantity.expected is not None}
    header = ["elbows"]
    for quantity in table[max(cases)]:
        header.append(f"{quantity.name} [{quantity.unit}]")
        if quantity.name in compared:
            header += [f"{quantity.name} published [{quantity.unit}]", f"{quantity.name} relative difference"]
    rows = []
    for elbows, listed in table.items():
        row: list[Any] = [elbows]
        for quantity in listed:
            row.append("" if quantity.value is None else f"{quantity.value:.6g}")
            if quantity.name in compared:
                row.append("" if quantity.expected is None else f"{quantity.expected:g}")
                row.append("" if quantity.difference is None else f"{quantity.difference:.5f}")
        rows.append(row)
    return write_csv(path, header, rows)


def numbers_table(cases: Mapping[int, Numbers], published: bool = True) -> Any:
    """The numbers as a table for the terminal, each with its difference from the published one.

    See `quantities` for the arguments.
    """
    from rich.box import SIMPLE
    from rich.markup import escape
    from rich.table import Table

    caption = "Tracking, errors and mean forces: t > 2 s."
    if published:
        caption += " In brackets: relative to the published number."
    table = Table(
        title="The paper's cases" if published else "The paper's cases, another arm", box=SIMPLE, caption=caption
    )
    table.add_column("", no_wrap=True)
    for elbows in cases:
        table.add_column(elbow_name(elbows), justify="right", no_wrap=True)
    for row in zip(*quantities(cases, published).values(), strict=True):
        table.add_row(
            escape(f"{row[0].name} [{row[0].unit}]".replace("_", " ")), *(_cell(quantity) for quantity in row)
        )
    return table


def _cell(quantity: Quantity) -> str:
    if quantity.value is None:
        return ""
    value = f"{quantity.value:.5g}"
    return value if quantity.difference is None else f"{value} ({quantity.difference:+.1%})"

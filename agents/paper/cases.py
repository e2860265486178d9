"""Runs of the paper's three cases: figures, numbers and a verdict on its claims."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from agents.evaluation.metrics import joint_energies, metrics
from agents.evaluation.recording import Recording, record, thinned
from agents.files import check_writable, write_csv, write_text, write_whole
from agents.paper.claims import Claim, Numbers, as_markdown, verdict
from agents.paper.figures import CASES, SETTLED, draw, write_series
from agents.style import ELBOW_NAMES
from agents.workers import Job, in_processes
from elbow_gym.baselines.pd import CLIPPED, UNLIMITED, PDController
from elbow_gym.parameters import as_elbows
from elbow_gym.task.settings import Settings

RESULTS = Path(__file__).parent / "results"
RECORD_PERIOD = 2e-4
"""Longest time between the instants that the numbers are taken from [s]; keeping every period takes longer to run."""
PICTURE_PERIOD = 0.002
"""Time between the points of the figures [s]."""
# A figure takes about as long to draw as this many control periods to run, so that one bar's time left holds for both.
FIGURE_PERIODS = 1500

RUNS: dict[str, dict[str, Any]] = {
    "paper": {**UNLIMITED, "start": "paper"},
    "on target": {**UNLIMITED, "start": "on_target"},
    "24 V": {**CLIPPED, "start": "paper"},
}
"""Arguments of the environment, but for the elbows and what all share, of the runs behind one case."""

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
"""Published reference for two, one and no elbow by field of `Numbers`: the PD continuous inside RK4 at 1e-4 s.

Rounded as published. Here each voltage is held for 1e-4 s, which makes the start of joint 1 cost 0.2 % more.
"""

UNITS = {"error_rms": "mm", "z_rms": "mm", "z_mean": "mm", "force_mean": "N", "force_smallest": "N", "below_table": "s"}
"""Units of the fields of `Numbers`; J where none is given."""


@dataclass(frozen=True)
class Reproduction:
    """Results of `reproduce` and the files that it wrote."""

    numbers: dict[int, Numbers]
    claims: list[Claim]
    output: Path


@dataclass(frozen=True)
class Played:
    """One run: its numbers from `measure` and its series, every `PICTURE_PERIOD`."""

    values: dict[str, Any]
    series: Recording


def reproduce(output: Path = Path("reproduction"), publish: bool = False) -> Reproduction:
    """Runs the paper's cases, prints their numbers and the verdict, and writes everything under `output`.

    Args:
        output: folder for fig01.png to fig25.png, paper_cases.png, series.csv, numbers.csv and verdict.md.
        publish: also refresh the README's picture and the numbers in agents/paper/results.
    """
    from rich.console import Console
    from rich.markdown import Markdown
    from tqdm import tqdm

    check_writable(output)
    jobs = {(elbows, name): settings_of(elbows, name) for elbows in CASES for name in RUNS}
    n_figures = 6 + 2 * jobs[2, "paper"].parsed_arm.n_joints
    total = sum(settings.horizon for settings in jobs.values()) + FIGURE_PERIODS * n_figures
    layout = "{desc} {percentage:3.0f}%|{bar}| {elapsed} elapsed, {remaining} left"
    with tqdm(total=total, desc="simulating", bar_format=layout) as bar:
        played = play_all(jobs, bar.update)
        numbers = {elbows: case_numbers({name: played[elbows, name].values for name in RUNS}) for elbows in CASES}
        series = {elbows: played[elbows, "paper"].series for elbows in CASES}
        bar.set_description("drawing")
        draw(series, output, lambda: bar.update(FIGURE_PERIODS))
    write_series(output / "series.csv", series)
    write_numbers(output / "numbers.csv", numbers)
    text = as_markdown(numbers)
    write_text(output / "verdict.md", text)
    if publish:
        overview = (output / "paper_cases.png").read_bytes()
        write_whole(RESULTS / "paper_cases.png", lambda temporary: temporary.write_bytes(overview))
        write_numbers(RESULTS / "paper_numbers.csv", numbers)
    console = Console()
    console.print(numbers_table(numbers))
    console.print(Markdown(text))
    return Reproduction(numbers, verdict(numbers), output)


def settings_of(elbows: int, name: str, **changes: Any) -> Settings:
    """The environment of one of `RUNS`."""
    return Settings(**{"elbows": elbows, "start_noise": 0.0, **RUNS[name], **changes})


def play(settings: Settings, progress: Callable[[int], Any] | None = None) -> Played:
    """One episode of the paper's PD, seed 0; `progress` gets the control periods done since its last call."""
    told = 0

    def tell(done: int, _horizon: int) -> None:
        nonlocal told
        if progress is not None:
            progress(done - told)
        told = done

    every = max(1, round(RECORD_PERIOD * settings.control_frequency))
    run = record(settings, PDController, (0,), tell, every)
    tell(settings.horizon, settings.horizon)
    return Played(measure(run), thinned(run, PICTURE_PERIOD))


def measure(run: Recording) -> dict[str, Any]:
    """The fields of `Numbers` that one run gives."""
    whole, late = metrics(run), metrics(run, SETTLED)
    settled, second = np.searchsorted(run.time, (SETTLED - 1e-9, 1.0 - 1e-9))
    return {
        "elbow_joints": run.settings.elbow_joints,
        "energy": float(whole["electrical_energy"][0]),
        "joint_energy": tuple(joint_energies(run)[0].tolist()),
        "joint_1_first_second": float(run.electrical_energy[second, 0, 0]),
        "energy_tracking": float(late["electrical_energy"][0]),
        "link_work": float(whole["link_work"][0]),
        "link_work_tracking": float(late["link_work"][0]),
        "error_rms": float(late["error_rms"][0]),
        "z_rms": float(late["z_rms"][0]),
        "z_mean": float(1e3 * (run.hand - run.target)[settled:, 0, 2].mean()),
        "force_mean": tuple(run.elbow_force[settled:, 0].mean(axis=0).tolist()),
        "force_smallest": tuple(run.elbow_force[:, 0].min(axis=0).tolist()),
        "below_table": float(whole["below_table"][0]),
    }


def case_numbers(runs: Mapping[str, Mapping[str, Any]]) -> Numbers:
    """Numbers of one case from those of its `RUNS`."""
    return Numbers(**runs["paper"], energy_on_target=runs["on target"]["energy"], energy_clipped=runs["24 V"]["energy"])


def play_all(jobs: Mapping[Any, Settings], progress: Callable[[int], Any]) -> dict[Any, Played]:
    """Results of `play` for every job, each in its own process."""
    return in_processes({key: Job(partial(play, jobs[key]), jobs[key].horizon) for key in jobs}, progress)


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


def quantities(elbows: int, numbers: Numbers) -> list[Quantity]:
    """Every number of a case, the same list for every case."""
    listed = []
    for name, value in asdict(numbers).items():
        if name == "elbow_joints":
            continue
        unit = UNITS.get(name, "J")
        expected = EXPECTED[name][CASES.index(elbows)] if name in EXPECTED else None
        if not isinstance(value, tuple):
            listed.append(Quantity(name, unit, value, expected))
            continue
        joints = range(1, len(value) + 1) if name == "joint_energy" else numbers.elbow_joints
        found = dict(zip(joints, zip(value, expected, strict=True), strict=True))
        everywhere = joints if name == "joint_energy" else as_elbows(2, 10)
        listed += [Quantity(f"{name}_{joint}", unit, *found.get(joint, (None, None))) for joint in everywhere]
    return listed


def write_numbers(path: Path, cases: Mapping[int, Numbers]) -> Path:
    """Writes a CSV row per case: every quantity, its published value and the relative difference, empty where none."""
    table = {elbows: quantities(elbows, numbers) for elbows, numbers in cases.items()}
    published = {quantity.name for listed in table.values() for quantity in listed if quantity.expected is not None}
    header = ["elbows"]
    for quantity in table[2]:
        header.append(f"{quantity.name} [{quantity.unit}]")
        if quantity.name in published:
            header += [f"{quantity.name} published [{quantity.unit}]", f"{quantity.name} relative difference"]
    rows = []
    for elbows, listed in table.items():
        row: list[Any] = [elbows]
        for quantity in listed:
            row.append("" if quantity.value is None else f"{quantity.value:.6g}")
            if quantity.name in published:
                row.append("" if quantity.expected is None else f"{quantity.expected:g}")
                row.append("" if quantity.difference is None else f"{quantity.difference:.5f}")
        rows.append(row)
    return write_csv(path, header, rows)


def numbers_table(cases: Mapping[int, Numbers]) -> Any:
    """The numbers as a table for the terminal, each with its difference from the published one."""
    from rich.box import SIMPLE
    from rich.markup import escape
    from rich.table import Table

    table = Table(
        title="The paper's cases",
        box=SIMPLE,
        caption="Tracking, errors and mean forces: t > 2 s. In brackets: relative to the published number.",
    )
    table.add_column("", no_wrap=True)
    for elbows in cases:
        table.add_column(ELBOW_NAMES[elbows], justify="right", no_wrap=True)
    for row in zip(*(quantities(elbows, numbers) for elbows, numbers in cases.items()), strict=True):
        table.add_row(
            escape(f"{row[0].name} [{row[0].unit}]".replace("_", " ")), *(_cell(quantity) for quantity in row)
        )
    return table


def _cell(quantity: Quantity) -> str:
    if quantity.value is None:
        return ""
    value = f"{quantity.value:.5g}"
    return value if quantity.difference is None else f"{value} ({quantity.difference:+.1%})"

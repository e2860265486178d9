"""Runs of the paper's cases, on its arm or another: figures, numbers and a verdict on its claims."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from agents.evaluation.metrics import joint_energies, metrics
from agents.evaluation.recording import Recording, record, thinned
from agents.files import check_writable, write_text, write_whole
from agents.jobs.job import Job
from agents.jobs.machines import do_all
from agents.paper.claims import Claim, Numbers, as_markdown, verdict
from agents.paper.figures import SETTLED, draw, write_series
from agents.paper.numbers import PUBLISHED_CASES, numbers_table, write_numbers
from agents.paper.subject import Subject
from agents.tasks import Elbows
from elbow_gym.baselines.pd import CLIPPED, UNLIMITED, PDController
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


def reproduce(
    output: Path = Path("reproduction"), publish: bool = False, subject: Subject | None = None
) -> Reproduction:
    """Runs the paper's cases, prints their numbers and the verdict, and writes everything under `output`.

    Args:
        output: folder for fig01.png to fig25.png, paper_cases.png, series.csv, numbers.csv and verdict.md; an arm of n
            joints has 5 + 2 n figures.
        publish: also refresh the README's picture and the numbers in agents/paper/results.
        subject: arm and elbows; the paper's when None.

    Raises:
        ValueError: results of another arm or other elbows than the paper's would be published, or the arm cannot lie
            on its elbows or follow a circle.
    """
    from rich.console import Console
    from rich.markdown import Markdown
    from tqdm import tqdm

    subject = subject or Subject()
    check_publishable(publish, subject)
    check_writable(output)
    cases = subject.cases
    jobs = {(elbows, name): settings_of(elbows, name, subject=subject) for elbows in cases for name in RUNS}
    n_figures = 6 + 2 * subject.arm.n_joints
    total = sum(settings.horizon for settings in jobs.values()) + FIGURE_PERIODS * n_figures
    layout = "{desc} {percentage:3.0f}%|{bar}| {elapsed} elapsed, {remaining} left"
    with tqdm(total=total, desc="simulating", bar_format=layout) as bar:
        played = play_all(jobs, bar.update)
        numbers = {elbows: case_numbers({name: played[elbows, name].values for name in RUNS}) for elbows in cases}
        series = {elbows: played[elbows, "paper"].series for elbows in cases}
        bar.set_description("drawing")
        draw(series, output, lambda: bar.update(FIGURE_PERIODS))
    write_series(output / "series.csv", series)
    write_numbers(output / "numbers.csv", numbers, subject.published)
    text = as_markdown(numbers, None if subject.published else subject.described())
    write_text(output / "verdict.md", text)
    if publish:
        overview = (output / "paper_cases.png").read_bytes()
        write_whole(RESULTS / "paper_cases.png", lambda temporary: temporary.write_bytes(overview))
        write_numbers(RESULTS / "paper_numbers.csv", numbers)
    console = Console()
    console.print(numbers_table(numbers, subject.published))
    console.print(Markdown(text))
    console.print(f"Wrote {n_figures} figures, series.csv, numbers.csv and verdict.md to {output}")
    return Reproduction(numbers, verdict(numbers), output)


def check_publishable(publish: bool, subject: Subject) -> None:
    """Raises ValueError where results of another arm or other elbows than the paper's would be published."""
    if publish and not (subject.published and subject.cases == PUBLISHED_CASES):
        raise ValueError(f"--publish must be given for the paper's arm on two elbows alone, got {subject.described()}")


def settings_of(elbows: Elbows, name: str, subject: Subject | None = None, **changes: Any) -> Settings:
    """The environment of one of `RUNS`, for one of the cases of a subject, the paper's arm when None."""
    chosen = {"elbows": elbows} if subject is None else subject.arguments(elbows)
    return Settings(**{**chosen, "start_noise": 0.0, **RUNS[name], **changes})


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
    return do_all({key: Job(partial(play, jobs[key]), jobs[key].horizon) for key in jobs}, progress)

"""Plays what the report shows: one episode of every controller from each start, without noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from agents.evaluation.metrics import REGIMES, metrics
from agents.evaluation.players import RECORDING_PERIOD
from agents.evaluation.recording import Recording, record, thinned
from agents.paper.cases import RECORD_PERIOD, measure
from agents.paper.figures import SERIES_PERIOD
from agents.report.roster import TABLE, Entry
from agents.workers import Job, in_processes
from elbow_gym.task.settings import STARTS

PAPER_PD = ("pd_paper", "pd")
"""Controllers whose runs give the paper's numbers (`agents.paper.cases.RUNS`)."""


@dataclass(frozen=True)
class Run:
    """One episode with its metrics."""

    controller: str
    """Name of the controller, as in the benchmark's tables."""
    bearing: str
    """What the arm leans on: "2", "1" or "0" elbows, or `agents.report.roster.TABLE`."""
    start: str
    """Value of the environment's `start`."""
    series: Recording
    """Recording at every `SERIES_PERIOD`, or every control period where that is longer."""
    figures: Mapping[str, Mapping[str, float]]
    """Metrics (`agents.evaluation.metrics.UNITS`) by regime, of the regimes with this start."""
    measured: Mapping[str, Any] | None = None
    """Numbers of `agents.paper.cases.measure`; None but for the paper's PD."""

    @property
    def key(self) -> str:
        """Name of the run in the page."""
        return f"{self.controller}-{self.bearing}-{self.start}"


def collect(entries: Sequence[Entry], progress: Callable[[int], Any]) -> list[Run]:
    """Both runs of every entry, in the entries' order, from as many processes as there are cores."""
    played = in_processes({entry: Job(partial(play, entry), entry.size) for entry in entries}, progress)
    return [run for entry in entries for run in played[entry]]


def play(entry: Entry, progress: Callable[[int], Any]) -> list[Run]:
    """An entry's runs from all starts; `progress` is told the entry's size in parts."""
    settings, make = entry.contender()
    paper = entry.name in PAPER_PD and entry.bearing != TABLE
    period = RECORD_PERIOD if paper else RECORDING_PERIOD
    every = max(1, round(settings.control_frequency * period))
    runs, told = [], 0
    for number, start in enumerate(STARTS):

        def tell(done: int, horizon: int, number: int = number) -> None:
            nonlocal told
            reached = round(entry.size * (number + done / horizon) / len(STARTS))
            progress(reached - told)
            told = reached

        started = replace(settings, start=start, start_noise=0.0)
        recording = record(started, make, (0,), tell, every)
        figures = {
            regime.name: {name: float(values[0]) for name, values in metrics(recording, regime.since).items()}
            for regime in REGIMES
            if regime.start == start
        }
        measured = measure(recording) if paper else None
        series = thinned(recording, SERIES_PERIOD)
        runs.append(Run(entry.controller, entry.bearing, start, series, figures, measured))
    return runs

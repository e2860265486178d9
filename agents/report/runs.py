"""Runs that the report shows: one episode of every controller from each start, without noise."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from agents.evaluation.guest import Guest
from agents.evaluation.metrics import REGIMES, metrics
from agents.evaluation.player import Player
from agents.evaluation.players import TABLE, Entry
from agents.evaluation.recording import Recording, thinned
from agents.evaluation.regimes import RECORDING_PERIOD, recordings
from agents.jobs.job import Job, Tell, counted
from agents.jobs.machines import do_all
from agents.paper.cases import RECORD_PERIOD, measure
from agents.paper.figures import SERIES_PERIOD
from agents.workers import compile_before
from elbow_gym.task.settings import STARTS

PAPER_PD = ("pd_paper", "pd")
"""Controllers whose runs give the paper's numbers (`agents.paper.cases.RUNS`)."""


@dataclass(frozen=True)
class Run:
    """One episode with its metrics."""

    controller: str
    """Name of the controller, as in the benchmark's tables."""
    bearing: str
    """Support of the arm: "2", "1" or "0" elbows, or `agents.evaluation.players.TABLE`."""
    start: str
    """Value of the environment's `start`."""
    series: Recording
    """Recording at every `SERIES_PERIOD`, or every control period where that is longer."""
    figures: Mapping[str, Mapping[str, float]]
    """Metrics (`agents.evaluation.metrics.UNITS`) by regime, of the regimes with this start."""
    measured: Mapping[str, Any] | None = None
    """Numbers of `agents.paper.cases.measure`; None but for the paper's PD."""
    label: str = ""
    """Name for readers of a player of a user's own; empty for the registry's."""

    @property
    def key(self) -> str:
        """Name of the run in the page."""
        return f"{self.controller}-{self.bearing}-{self.start}"


@dataclass(frozen=True)
class Visitor:
    """A player of a user's own at a number of elbows, where the registry has an `Entry`."""

    guest: Guest
    elbows: int

    @property
    def name(self) -> str:
        """Name inside the page, which CSS and HTML take."""
        return "own-" + re.sub(r"[^A-Za-z0-9]+", "-", self.guest.label)

    @property
    def bearing(self) -> str:
        """Support of the arm: its number of elbows."""
        return str(self.elbows)

    def player(self) -> Player:
        """The player."""
        return self.guest.player(self.elbows, {})


def collect(entries: Sequence[Entry | Visitor]) -> list[Run]:
    """Both runs of every entry, in the entries' order, from as many processes as there are cores, with a bar."""
    from tqdm import tqdm

    players = {entry: entry.player() for entry in entries}
    sizes = {entry: len(STARTS) * player.work for entry, player in players.items()}
    alone = [(player.settings, 1) for player in players.values() if not player.starts_together]
    # The LQR finds its gains with a batch.
    batches = [player.settings for player in players.values() if player.name == "lqr"]
    compile_before([*alone, *((player.settings, len(STARTS)) for player in players.values()), *batches])
    layout = "{desc} {percentage:3.0f}%|{bar}| {elapsed} elapsed, {remaining} left"
    # Work is told of in bursts: the time left follows the mean speed.
    with tqdm(total=sum(sizes.values()), desc="playing", bar_format=layout, smoothing=0.0, file=sys.stderr) as bar:
        played = do_all({entry: Job(partial(play, entry), sizes[entry]) for entry in entries}, bar.update)
    return [run for entry in entries for run in played[entry]]


def play(entry: Entry | Visitor, progress: Tell) -> list[Run]:
    """An entry's runs from all starts; `progress` gets the units of work done since its last call."""
    best = entry.player()
    exact = replace(best, settings=replace(best.settings, start_noise=0.0))
    paper = entry.name in PAPER_PD and entry.bearing != TABLE
    tell = counted(len(STARTS) * best.work, progress)
    runs = []
    for start, recording in recordings(exact, STARTS, (0,), tell, RECORD_PERIOD if paper else RECORDING_PERIOD).items():
        figures = {
            regime.name: {name: float(values[0]) for name, values in metrics(recording, regime.since).items()}
            for regime in REGIMES
            if regime.start == start
        }
        measured = measure(recording) if paper else None
        label = best.label if isinstance(entry, Visitor) else ""
        series = thinned(recording, SERIES_PERIOD)
        runs.append(Run(entry.name, entry.bearing, start, series, figures, measured, label))
    return runs

"""Planners beside policies and the bound, on the nominal task and on the first evaluation tasks."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.controller import Controller
from agents.evaluation.metrics import metrics
from agents.evaluation.player import Player
from agents.evaluation.players import ELBOW_COUNTS, Entry, find_player
from agents.evaluation.recording import record
from agents.files import write_csv, write_text
from agents.jobs.job import Job, Tell
from agents.jobs.machines import Machines, do_all
from agents.optimal.certificate import LATER
from agents.style import look
from agents.tasks import plain_arguments
from agents.workers import compile_before
from benchmarks.blocks import publish_blocks
from benchmarks.energy import cache
from benchmarks.energy.markdown import significant
from benchmarks.machine import CACHE, RESULTS
from benchmarks.optimal import Cell, cached
from benchmarks.tasks import episodes
from benchmarks.tasks.optima import optimal_figures
from benchmarks.tasks.task_set import EVALUATION
from elbow_gym.suite import ENV

DRAWN = "newton_tasks"
"""Policy of drawn tasks."""
PLAYERS = (
    "receding_horizon",
    "receding_horizon_payload",
    "sampling_mpc",
    "sampling_mpc_payload",
    DRAWN,
    "ppo",
    "computed_torque",
)
"""Players of the table."""
NOMINAL = "nominal"
FIGURES = ("return [-]", "energy [J]", "error_rms [mm]", "decision [ms]", "failures [-]")
"""Figures of an episode; the error counts from `LATER` on, and a failure is a period without a plan of its own. An
episode that a controller refuses has the worst figures, and decisions of no time."""
HEADER = ("task", "elbows", "controller", *FIGURES, "bound [-]")
"""Columns of the CSV."""


@dataclass(frozen=True)
class Task:
    """The nominal task, or an evaluation task, at an elbow count."""

    elbows: int
    number: int | None = None
    """Number of the evaluation task; None for the nominal one."""

    @property
    def name(self) -> str:
        """Name in the CSV."""
        return NOMINAL if self.number is None else str(self.number)

    def bound(self) -> float | None:
        """The best known negative return; None where none was found."""
        if self.number is None:
            figures = cached(Cell(self.elbows, "paper"))
            return None if figures is None else float(figures["closed_loop"])
        solved = optimal_figures().get((self.elbows, self.number))
        return None if solved is None else solved["cost"]

    def play(self, player: Player) -> dict[str, float]:
        """Figures of an episode, by the names in `FIGURES`."""
        made: list[Timed] = []

        def timed(controller: Controller) -> Controller:
            made.append(Timed(controller))
            return made[0]

        figures = self._nominal(player, timed) if self.number is None else self._drawn(player, self.number, timed)
        seconds, inner = (made[0].seconds, made[0].inner) if made else ([], None)
        decision = 1e3 * np.median(seconds) if seconds else 0.0
        return dict(zip(FIGURES, map(float, (*figures, decision, getattr(inner, "failures", 0))), strict=True))

    def _nominal(self, player: Player, timed: Any) -> tuple[float, ...]:
        from threadpoolctl import threadpool_limits

        still = {"circle": None, "start": "paper", "start_noise": 0.0, "start_spread": 0.0, "randomize": None}
        # What threads of BLAS do besides would not be counted.
        with threadpool_limits(1):
            recording = record(replace(player.settings, **still), lambda env: timed(player.make(env)), [0])
        whole, later = metrics(recording), metrics(recording, LATER)
        return whole["return"][0], whole["electrical_energy"][0], later["error_rms"][0]

    def _drawn(self, player: Player, number: int, timed: Any) -> tuple[float, ...]:
        undisturbed = episodes.DISTURBANCES[episodes.NOMINAL]
        figures = episodes.play(player, number, EVALUATION.numbered(self.elbows)[number], undisturbed, timed)
        return -figures["cost"], figures["energy"], figures["error_rms"]


class Timed:
    """Controller that measures the CPU time of another one's decisions.

    Args:
        inner: the other one.
    """

    def __init__(self, inner: Controller) -> None:
        self.inner = inner
        self.seconds: list[float] = []
        """CPU time of each decision [s]."""

    def predict(self, observation: NDArray[np.float32], *args: Any, **kwargs: Any) -> tuple[NDArray[np.float32], Any]:
        """The other controller's actions."""
        before = time.thread_time()
        answer = self.inner.predict(observation, *args, **kwargs)
        self.seconds.append(time.thread_time() - before)
        return answer


def _player(name: str, elbows: int) -> Player:
    return Entry(name, elbows, ENV).player() if name == DRAWN else find_player(name, elbows)


def _played(task: Task, name: str, folder: Path, tell: Tell) -> dict[str, float]:
    """Figures of an episode, from the folder where the same was played before."""
    player = _player(name, task.elbows)
    options = None if task.number is None else EVALUATION.numbered(task.elbows)[task.number]
    question = {"player": player.identity, "settings": plain_arguments(player.settings), "planners": options}
    key = cache.key(json.loads(json.dumps(question)))
    stored = cache.load(key, folder)
    tell(1)
    if stored is None:
        stored = {NOMINAL: {figure: np.array([value]) for figure, value in task.play(player).items()}}
        cache.store(key, stored, folder)
    return {figure: float(values[0]) for figure, values in stored[NOMINAL].items()}


def planners(
    output: Path,
    drawn: int,
    elbows: Sequence[int],
    publish: bool = False,
    machines: Machines | None = None,
    folder: Path = CACHE,
) -> str:
    """Plays `PLAYERS` on the nominal tasks and on evaluation tasks; writes planners.csv and .md. Returns the table.

    Args:
        output: folder of the results, unless they are published.
        drawn: number of evaluation tasks at each elbow count, the first ones that are solved.
        elbows: elbow counts of the evaluation tasks.
        publish: whether the results go to benchmarks/results, and the table into the README.
        machines: what plays.
        folder: folder of what was played before.

    Raises:
        ValueError: CasADi is missing.
    """
    from tqdm import tqdm

    if find_spec("casadi") is None:
        raise ValueError('casadi must be installed for the planners: pip install "elbow-gym[optimal]"')
    output, solved = RESULTS if publish else output, sorted(optimal_figures())
    tasks = [Task(count) for count in ELBOW_COUNTS]
    for count in elbows:
        tasks += [Task(count, number) for of, number in solved if of == count][:drawn]
    players = [_player(name, count) for name in PLAYERS for count in ELBOW_COUNTS]
    compile_before([*((player.settings, 1) for player in players), *(player.settings for player in players)])
    jobs = {(task, name): Job(partial(_played, task, name, folder), 1) for task in tasks for name in PLAYERS}
    with tqdm(total=len(jobs), unit="episode", file=sys.stderr) as bar:
        played = do_all(jobs, bar.update, machines)
    known = {task: task.bound() for task in tasks}
    rows = [
        [
            task.name,
            task.elbows,
            name,
            *(f"{figures[figure]:.6g}" for figure in FIGURES),
            "" if (bound := known[task]) is None else f"{-bound:.6g}",
        ]
        for (task, name), figures in played.items()
    ]
    write_csv(output / "planners.csv", HEADER, rows)
    text = table(rows)
    write_text(output / "planners.md", text)
    if publish:
        publish_blocks(output)
    return text


def table(found: Sequence[Sequence[Any]]) -> str:
    """Rows as Markdown: the nominal ones by elbow count, then the drawn ones' means by controller."""
    lines = ["| task | controller | return | bound | energy (J) | error from 2 s on (mm) | a decision (ms) |"]
    lines.append("|---|---|---|---|---|---|---|")
    named = {(str(row[0]), int(row[1])) for row in found}
    nominal = sorted((key for key in named if key[0] == NOMINAL), key=lambda key: -key[1])
    for key in nominal:
        for row in (row for row in found if (str(row[0]), int(row[1])) == key):
            lines.append(_line(f"{NOMINAL}, elbows {key[1]}", [row]))
    drawn = sorted(key for key in named if key[0] != NOMINAL)
    for elbows in sorted({key[1] for key in drawn}, reverse=True):
        of = [row for row in found if str(row[0]) != NOMINAL and int(row[1]) == elbows]
        for name in dict.fromkeys(row[2] for row in of):
            own = [row for row in of if row[2] == name]
            lines.append(_line(f"mean of {len(own)} drawn, elbows {elbows}", own))
    return "\n".join(lines) + "\n"


def _line(title: str, own: Sequence[Sequence[Any]]) -> str:
    means = [np.mean([float(row[k]) for row in own]) for k in (3, 4, 5, 6)]
    bounds = [row[8] for row in own]
    bound = "" if "" in bounds else significant(float(np.mean([float(one) for one in bounds])), 4)
    cells = [significant(float(means[0]), 4), bound, *(significant(float(mean)) for mean in means[1:])]
    return f"| {title} | {look(own[0][2])[0]} | {' | '.join(cells)} |"

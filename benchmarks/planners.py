"""Planners beside a policy and the bound, on the nominal task and on tasks drawn at random."""

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
from agents.evaluation.players import ELBOW_COUNTS, find_player
from agents.evaluation.recording import record
from agents.files import write_csv, write_text
from agents.jobs.job import Job, Tell
from agents.jobs.machines import do_all
from agents.optimal.batch import bounds
from agents.optimal.problem import Problem
from agents.optimal.store import Store
from agents.style import look
from agents.tasks import plain_arguments
from agents.workers import compile_before
from benchmarks.blocks import publish_blocks
from benchmarks.energy import cache
from benchmarks.energy.markdown import significant
from benchmarks.machine import CACHE, RESULTS
from benchmarks.optimal import Cell, cached
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

PLAYERS = (
    "receding_horizon",
    "receding_horizon_payload",
    "sampling_mpc",
    "sampling_mpc_payload",
    "ppo",
    "computed_torque",
)
"""Players of the table."""
SEED = 26
"""Seed of the drawn tasks."""
CENTER, CENTER_SPREAD = (1.5, 1.5, 0.4), 0.15
RADIUS, PERIOD, PAYLOAD = (0.05, 0.15), (3.0, 8.0), (0.0, 0.3)
"""Ranges of the drawn circles [m, s] and loads [kg]."""
LATER = 2.0
"""Time from which the hand is taken to be on its path [s]."""
NOMINAL = "nominal"
FIGURES = ("return [-]", "energy [J]", "error_rms [mm]", "decision [ms]", "failures [-]")
"""Figures of an episode; the error counts from `LATER` on, and a failure is a period without a plan of its own."""
HEADER = ("task", "elbows", "controller", *FIGURES, "bound [-]")
"""Columns of the CSV."""


@dataclass(frozen=True, eq=False)
class Task:
    """An environment's arguments, from a start without noise."""

    name: str
    elbows: int
    arguments: dict[str, Any]

    @property
    def settings(self) -> Settings:
        """Arguments of the environment at the default control rate."""
        return Settings(elbows=self.elbows, **self.arguments)

    def bound(self) -> float | None:
        """The best known negative return; None where none was sought or found."""
        if self.name == NOMINAL:
            figures = cached(Cell(self.elbows, "paper"))
        else:
            try:
                stored = Store().load(Problem(self.settings, self.elbows < 2))
            except ValueError:
                # No start pose of this task has the hand on the circle.
                return None
            figures = None if stored is None else stored[0]
        return None if figures is None else float(figures["closed_loop"])


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


def drawn_tasks(count: int, elbows: int) -> list[Task]:
    """Tasks with circles, loads and starts drawn at random, the same at every elbow count.

    A task that the settings refuse at some elbow count is drawn again.
    """
    rng, found = np.random.default_rng(SEED), []
    while len(found) < count:
        center = np.array(CENTER) + rng.uniform(-CENTER_SPREAD, CENTER_SPREAD, 3)
        circle = {
            "center": center.round(4).tolist(),
            "radius": round(rng.uniform(*RADIUS), 4),
            "period": round(rng.uniform(*PERIOD), 3),
        }
        payload, start = round(rng.uniform(*PAYLOAD), 3), ("paper", "on_target")[rng.integers(2)]
        arguments = {"circle": circle, "payload": payload, "start": start, "start_noise": 0.0}
        try:
            for bearing in sorted(ELBOW_COUNTS):
                Settings(elbows=bearing, **arguments)
        except ValueError:
            continue
        found.append(Task(str(len(found)), elbows, arguments))
    return found


def playable(tasks: Sequence[Task], count: int) -> list[Task]:
    """The first tasks whose start pose exists."""
    found = []
    for task in tasks:
        try:
            ElbowArmVectorEnv(1, elbows=task.elbows, **task.arguments).reset(seed=0)
        except ValueError:
            continue
        found.append(task)
    return found[:count]


def play(task: Task, player: Player) -> dict[str, float]:
    """Figures of an episode, by the names in `FIGURES`."""
    from threadpoolctl import threadpool_limits

    made: list[Timed] = []

    def make(env: ElbowArmVectorEnv) -> Timed:
        made.append(Timed(player.make(env)))
        return made[0]

    # What threads of BLAS do besides would not be counted.
    with threadpool_limits(1):
        recording = record(replace(player.settings, **task.arguments), make, [0])
    whole, later = metrics(recording), metrics(recording, LATER)
    figures = (
        whole["return"][0],
        whole["electrical_energy"][0],
        later["error_rms"][0],
        1e3 * np.median(made[0].seconds),
        getattr(made[0].inner, "failures", 0),
    )
    return dict(zip(FIGURES, map(float, figures), strict=True))


def _played(task: Task, name: str, folder: Path, tell: Tell) -> dict[str, float] | None:
    """Figures of an episode, from the folder where the same was played before; None where the controller refuses it."""
    player = find_player(name, task.elbows)
    question = {"player": player.identity, "settings": plain_arguments(player.settings), "task": task.arguments}
    key = cache.key(json.loads(json.dumps(question)))
    stored = cache.load(key, folder)
    tell(1)
    if stored is None:
        try:
            figures = play(task, player)
        except ValueError:
            # Computed torque moves its hand with the last two links alone, which do not cover every circle.
            return None
        stored = {NOMINAL: {figure: np.array([value]) for figure, value in figures.items()}}
        cache.store(key, stored, folder)
    return {figure: float(values[0]) for figure, values in stored[NOMINAL].items()}


def planners(
    output: Path,
    drawn: int,
    elbows: Sequence[int],
    solve: bool = False,
    publish: bool = False,
    folder: Path = CACHE,
) -> str:
    """Plays `PLAYERS` on the nominal tasks and on drawn ones; writes planners.csv and .md. Returns the table.

    Args:
        output: folder of the results, unless they are published.
        drawn: number of drawn tasks at each elbow count.
        elbows: elbow counts of the drawn tasks.
        solve: whether bounds of drawn tasks that were not sought before are sought now.
        publish: whether the results go to benchmarks/results, and the table into the README.
        folder: folder of what was played before.

    Raises:
        ValueError: CasADi is missing.
    """
    from tqdm import tqdm

    if find_spec("casadi") is None:
        raise ValueError('casadi must be installed for the planners: pip install "elbow-gym[optimal]"')
    output = RESULTS if publish else output
    tasks = [Task(NOMINAL, count, {"start_noise": 0.0}) for count in ELBOW_COUNTS]
    for count in elbows:
        # A task whose start pose cannot reach its circle is passed over.
        tasks += playable(drawn_tasks(2 * drawn, count), drawn)
    players = [find_player(name, count) for name in PLAYERS for count in ELBOW_COUNTS]
    compile_before([*((player.settings, 1) for player in players), *(player.settings for player in players)])
    jobs = {(task, name): Job(partial(_played, task, name, folder), 1) for task in tasks for name in PLAYERS}
    with tqdm(total=len(jobs), unit="episode", file=sys.stderr) as bar:
        played = do_all(jobs, bar.update)
    if solve:
        bounds([task.settings for task in tasks if task.name != NOMINAL])
    known = {task: task.bound() for task in tasks}
    rows = [
        [
            task.name,
            task.elbows,
            name,
            *(f"{figures[figure]:.6g}" for figure in FIGURES),
            "" if known[task] is None else f"{-known[task]:.6g}",
        ]
        for (task, name), figures in played.items()
        if figures is not None
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

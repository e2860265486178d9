"""A user's own players and arm in the energy benchmark, from the command line and from Python."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from agents.evaluation.guest import Guest
from agents.evaluation.players import PLANNERS, known_names
from agents.task_options import TaskOptions
from agents.tasks import task_settings
from benchmarks.energy import terminal
from benchmarks.energy.cells import Cell, guest_cells
from benchmarks.energy.rows import Row
from benchmarks.energy.run import FEW, energy, measure, plan


def measure_own(task: TaskOptions, names: Sequence[str], trust: bool, **options: Any) -> list[Row]:
    """The benchmark with players of the user's own, also on an arm of the user's own. Returns the rows.

    Args:
        task: elbows, arm and further arguments of the environment.
        names: players, as `find_player` takes them.
        trust: whether files that may run code when they are read may be read.
        options: arguments of `energy`.

    Raises:
        ValueError: a player is unknown or plays nowhere, or joint numbers are given for the paper's arm.
    """
    planners = [name for name in names if name in PLANNERS]
    options["planners"] = planners
    guests = [Guest.named(name, trust) for name in names if name not in PLANNERS]
    if task.arm is None and not task.environment:
        if isinstance(task.elbows, tuple):
            raise ValueError(f"--elbows must be 0, 1 or 2 without --arm or --environment, got {task.elbows}")
        return energy(**options, guests=guests, elbows=task.elbows)
    settings = task.settings()
    task.tell(settings)
    return energy(**options, guests=guests, arguments={**task.arguments(), "elbows": settings.elbow_joints})


@dataclass(frozen=True)
class Scores:
    """Players' rows, and their report as text."""

    rows: Sequence[Row]

    def __str__(self) -> str:
        return terminal.table(self.rows)


def score(
    player: Any,
    elbows: int = 2,
    *,
    label: str | None = None,
    beside: Sequence[str] = ("pd", "ppo"),
    episodes: int = FEW,
    trust: bool = False,
) -> Scores:
    """A player's energy, error and return beside others', in the regimes A, B and C of the benchmark.

    Args:
        player: a name, path or import path as the command line takes it; or a Python object: a controller with
            `predict(observation)`, which maps observations (B, 41) to actions (B, 10), or a function or class that
            makes one for an environment. Its attribute `environment` may hold arguments of the environment.
        elbows: elbows on the table, 0, 1 or 2.
        label: name in the table; the player's own when None.
        beside: names of the registry's players to compare it with.
        episodes: start poses, each from a fixed seed.
        trust: whether a file that may run code when it is read may be read.

    Returns:
        The rows; printed, they are a small table.

    Raises:
        ValueError: there is no such player, or it does not fit the environment.
    """
    task_settings("ElbowArm-v0", elbows)
    for name in beside:
        if name not in known_names(elbows):
            raise ValueError(f"beside must hold names of {known_names(elbows)}, got {name!r}")
    if isinstance(player, str):
        named = Guest.named(player, trust)
        guest = named if label is None else Guest(label, named.what, trust)
    else:
        guest = Guest(label or getattr(player, "__name__", type(player).__name__), player, trust)
    chosen = plan(full=False, episodes=episodes)
    cells = [*guest_cells([guest], [elbows]), *(Cell(name, elbows) for name in beside)]
    return Scores(measure(replace(chosen, cells=cells), parallel=False))

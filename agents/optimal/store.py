"""Store of solved tasks: a folder that git ignores, with files named by a digest of task and program."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.trajectory import Trajectory
from agents.files import write_text, write_whole
from agents.optimal.problem import Problem
from agents.optimal.solution import Point
from agents.shipped import OPTIMA
from elbow_gym.task.settings import Settings

STORE = Path(__file__).parents[2] / ".benchmarks" / "bounds"
"""Folder of the solved tasks; ignored by git."""
SOURCES = (
    "agents/optimal",
    "agents/planning",
    "agents/control",
    "elbow_gym/simulation",
    "elbow_gym/kernel",
    "elbow_gym/task",
)
"""Folders whose sources a solution or the simulator's verdict on it depends on."""
SCALES = {"target": 0.1, "start": 0.3, "payload": 0.15, "weight": 0.5}
"""Differences that count as a distance of one: targets (root mean square) [m], start pose (largest) [rad], payload
[kg], logarithm of the energy's weight over the tracking's [-]."""
BESIDE = ("x", "bound_multipliers", "multipliers", "target")
"""Names of the arrays beside a trajectory's: the program's variables and multipliers, and the targets."""
FARTHEST = 6.0
"""Distance up to which a task is solved from another one."""


@dataclass(frozen=True)
class Neighbour:
    """A solved task to start from."""

    name: str
    """Key of the task in the store, or name of the shipped optimum."""
    distance: float
    """Sum of its differences in units of `SCALES` [-]."""
    trajectory: Trajectory
    """Its solution in the simulator."""
    point: Point | None
    """Variables and multipliers of its program; None where another version solved it."""


@dataclass(frozen=True)
class Store:
    """Solved tasks in a folder."""

    folder: Path = STORE

    def key(self, problem: Problem) -> str:
        """Name of a problem's files: digest of its question and of the sources."""
        asked = json.dumps(problem.question, sort_keys=True)
        return hashlib.sha256(f"{sources()}{asked}".encode()).hexdigest()[:32]

    def load(self, problem: Problem) -> tuple[dict[str, Any], Trajectory] | None:
        """Figures and trajectory of a solved problem, or None."""
        card, arrays = self._files(self.key(problem))
        if not (card.is_file() and arrays.is_file()):
            return None
        return json.loads(card.read_text(encoding="utf-8"))["figures"], Trajectory.load(arrays, beside=BESIDE)

    def save(self, problem: Problem, figures: dict[str, Any], trajectory: Trajectory, point: Point) -> None:
        """Writes a solved problem's two files; the card last, so that it counts only when both are there."""
        card, path = self._files(self.key(problem))
        arrays = {field.name: getattr(trajectory, field.name) for field in fields(trajectory)}
        if point.multipliers is not None:
            arrays |= {"x": point.x, "bound_multipliers": point.multipliers[0], "multipliers": point.multipliers[1]}
        arrays["target"] = problem.target
        write_whole(path, lambda temporary: np.savez_compressed(temporary, **arrays))
        plain = {"problem": problem.question, "figures": figures, "sources": sources()}
        write_text(card, json.dumps(plain, indent=2) + "\n")

    def nearest(self, problem: Problem) -> Neighbour | None:
        """The nearest task with the problem's arm, elbows, supply and periods within `FARTHEST`, or None.

        The shipped optima count, too.
        """
        found = min(self._distances(problem), key=lambda one: one[:2], default=None)
        if found is None or found[0] > FARTHEST:
            return None
        distance, name, path, own = found
        if not own:
            # Another version's solution is but a motion: its variables may mean something else.
            return Neighbour(name, distance, Trajectory.load(path, beside=BESIDE), None)
        with np.load(path, allow_pickle=False) as arrays:
            point = Point(arrays["x"], (arrays["bound_multipliers"], arrays["multipliers"]))
        return Neighbour(name, distance, Trajectory.load(path, beside=BESIDE), point)

    def _distances(self, problem: Problem) -> Iterator[tuple[float, str, Path, bool]]:
        """Distance, name and file of every task with the problem's frame, and whether this version solved it."""
        frame = json.loads(json.dumps(problem.frame))
        for card in sorted(self.folder.glob("*.json")):
            plain, path = json.loads(card.read_text(encoding="utf-8")), self._files(card.stem)[1]
            asked = plain["problem"]
            if all(asked.get(name) == value for name, value in frame.items()) and path.is_file():
                with np.load(path, allow_pickle=False) as arrays:
                    target = arrays["target"]
                yield _distance(problem, asked, target), card.stem, path, plain["sources"] == sources()
        for card in sorted(OPTIMA.glob("*.json")):
            arguments = json.loads(card.read_text(encoding="utf-8"))["problem"]
            above_table = arguments.pop("above_table")
            solved, path = Problem(Settings(**arguments), above_table), card.with_suffix(".npz")
            if json.loads(json.dumps(solved.frame)) == frame and path.is_file():
                yield _distance(problem, solved.question, solved.target), card.stem, path, False

    def _files(self, key: str) -> tuple[Path, Path]:
        return self.folder / f"{key}.json", self.folder / f"{key}.npz"


def _distance(problem: Problem, asked: dict[str, Any], target: NDArray[np.float64]) -> float:
    """Sum of the differences to a solved task, its question and its targets [m], (N, 3), in units of `SCALES`."""
    wanted = problem.question
    differences = {
        "target": float(np.sqrt(((target - problem.target) ** 2).sum(axis=-1).mean())),
        "start": float(np.abs(np.array(asked["start"]) - problem.start).max()),
        "payload": abs(asked["payload"] - wanted["payload"]),
        "weight": abs(_relative_weight(asked) - _relative_weight(wanted)),
    }
    return sum(value / SCALES[name] for name, value in differences.items())


def _relative_weight(question: dict[str, Any]) -> float:
    tiny = 1e-9
    return math.log((question["energy_weight"] + tiny) / (question["tracking_weight"] + tiny))


@cache
def sources() -> str:
    """Digest of the sources that a solution depends on."""
    digest, root = hashlib.sha256(), Path(__file__).parents[2]
    for folder in SOURCES:
        for path in sorted((root / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:32]

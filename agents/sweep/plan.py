"""Plan of a sweep: the algorithms, elbows, settings and arguments of the environment that it compares, over seeds."""

from __future__ import annotations

import hashlib
import json
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.cli import Count, JsonObject, Seed
from agents.files import read_json
from agents.learning.command import Schedule, runs_of
from agents.learning.presets import ALGORITHMS, default_settings
from agents.learning.settings import AlgorithmSettings
from agents.task_options import Elbows, EnvironmentId, TaskOptions

if TYPE_CHECKING:
    # The simulator comes with it, and the command's help is said without.
    from agents.learning.run import Run

FILE = "sweep.json"
"""File of a sweep's plan in its folder."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """What is compared with others: an algorithm with its settings, in an environment."""

    algorithm: str
    """Name of the algorithm."""
    task: TaskOptions
    """The environment."""
    changes: dict[str, Any]
    """Settings that differ from the algorithm's for the task, JSON types only."""

    @property
    def settings(self) -> AlgorithmSettings:
        """Settings of the algorithm. Raises ValueError naming one that it does not have, or refuses."""
        default = default_settings(self.algorithm, self.task.name)
        known = [one.name for one in fields(default)]
        for name in self.changes:
            if name not in known:
                raise ValueError(f"settings of {self.algorithm} must be among {', '.join(known)}, got {name}")
        try:
            return replace(default, **{name: _tuple(value) for name, value in self.changes.items()})
        except TypeError as error:
            given = json.dumps(self.changes)
            raise ValueError(f"settings must hold values of the right type, got {given} ({error})") from error

    @property
    def question(self) -> tuple[str, str, str]:
        """The task as far as returns depend on it: only trials of the same can be compared."""
        return self.task.env, self.task.name, json.dumps(self.task.environment, sort_keys=True)

    @property
    def label(self) -> str:
        """Eight letters that stand for the settings and arguments that differ from the defaults; "" where none does."""
        changes = {"settings": self.changes, "environment": self.task.environment}
        digest = hashlib.sha256(json.dumps(changes, sort_keys=True).encode()).digest()
        return "".join(chr(ord("a") + byte % 26) for byte in digest[:8]) if any(changes.values()) else ""

    @property
    def name(self) -> str:
        """Name of the trial's runs, ALGORITHM[_LABEL]_TASK."""
        return "_".join(part for part in (self.algorithm, self.label, self.task.name) if part)

    def runs(self, schedule: Schedule) -> list[Run]:
        """Its trainings, one a seed, in a folder each. Raises ValueError where something is refused."""
        return runs_of(self.task, schedule, self.settings, shlex.join(self.command(schedule)))

    def command(self, schedule: Schedule) -> list[str]:
        """Command line that trains the same."""
        words = ["python", "-m", "agents", "train", self.algorithm, "--env", self.task.env]
        words += ["--seeds", str(schedule.seeds), "--first-seed", str(schedule.first_seed)]
        if schedule.label:
            words += ["--label", schedule.label]
        elbows = self.task.elbows
        if elbows is not None:
            words += ["--elbows", ",".join(map(str, elbows)) if isinstance(elbows, tuple) else str(elbows)]
        if self.task.environment:
            words += ["--environment", json.dumps(self.task.environment)]
        for name, value in self.changes.items():
            option = name.replace("_", "-")
            if isinstance(value, bool):
                words.append(f"--{option}" if value else f"--no-{option}")
            else:
                words += [f"--{option}", *map(str, value if isinstance(value, list) else [value])]
        return words


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is compared: every algorithm with every choice of elbows, settings and arguments of the environment.

    Raises:
        ValueError: an algorithm is unknown, or there is nothing to compare.
    """

    algorithms: tuple[str, ...] = ("ppo",)
    """Names of algorithms."""
    env: EnvironmentId = "ElbowArm-v0"
    """Gymnasium id of the environment."""
    elbows: tuple[Elbows, ...] = (None,)
    """Elbows on the table, one or more choices of what `python -m agents train --help` says."""
    seeds: Count = 3
    """Number of seeds of each choice; it is scored by the interquartile mean over them."""
    first_seed: Seed = 0
    """First seed; the others follow it."""
    settings: JsonObject = field(default_factory=dict)
    """Settings of the algorithms, each a value or a list of choices, such as '{"gamma": [0.97, 0.99]}'.
    Those of one algorithm alone stand under its name."""
    environment: JsonObject = field(default_factory=dict)
    """Arguments of the environment, each a value or a list of choices."""
    checkpoint_seconds: float = 60.0
    """Time between two checkpoints of a run [s]."""

    def __post_init__(self) -> None:
        for name in ("algorithms", "elbows"):
            if not getattr(self, name):
                raise ValueError(f"{name} must be at least one, got none")
        for algorithm in self.algorithms:
            if algorithm not in ALGORITHMS:
                raise ValueError(f"algorithms must be among {', '.join(ALGORITHMS)}, got {algorithm}")
        if self.seeds < 1:
            raise ValueError(f"seeds must be positive, got {self.seeds}")
        for name in ALGORITHMS:
            if not isinstance(self.settings.get(name, {}), dict):
                raise ValueError(f"{name} in settings must be an object, got {self.settings[name]}")

    def trials(self) -> list[Trial]:
        """All trials, each once. Raises ValueError where a setting or an argument is refused, or has no choice."""
        found: dict[str, Trial] = {}
        for algorithm, elbows in product(self.algorithms, self.elbows):
            shared = {name: value for name, value in self.settings.items() if name not in ALGORITHMS}
            for changes in _choices("settings", {**shared, **self.settings.get(algorithm, {})}):
                for arguments in _choices("environment", self.environment):
                    task = TaskOptions(env=self.env, elbows=elbows, environment=arguments)
                    trial = Trial(algorithm=algorithm, task=task, changes=changes)
                    found[trial.name] = trial
        return list(found.values())

    def runs(self, folder: Path) -> dict[str, tuple[Trial, list[Run]]]:
        """All trials and their runs, in folders of this one, by the trials' names. Raises ValueError as `trials`."""
        each = {"seeds": self.seeds, "first_seed": self.first_seed, "checkpoint_seconds": self.checkpoint_seconds}
        return {
            trial.name: (trial, trial.runs(Schedule(output=folder, label=trial.label, **each)))
            for trial in self.trials()
        }

    def to_dict(self) -> dict[str, Any]:
        """The plan in JSON types."""
        return json.loads(json.dumps(asdict(self)))

    @classmethod
    def read(cls, path: Path) -> Plan:
        """The plan in a JSON file. Raises ValueError naming the file where it holds something else."""
        plain = read_json(path)
        known = [one.name for one in fields(cls)]
        for name in plain:
            if name not in known:
                raise ValueError(f"{path} must hold only {', '.join(known)}, got {name}")
        try:
            # The choices of a dict stay lists, as a command line has them.
            return cls(**{name: _tuple(value) for name, value in plain.items()})
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {error}") from error


def _choices(what: str, given: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Every choice of a value for each name."""
    lists = {name: value if isinstance(value, list) else [value] for name, value in given.items()}
    for name, values in lists.items():
        if not values:
            raise ValueError(f"{name} in {what} must have at least one choice, got none")
    for chosen in product(*lists.values()):
        yield dict(zip(lists, chosen, strict=True))


def _tuple(value: Any) -> Any:
    return tuple(map(_tuple, value)) if isinstance(value, list) else value

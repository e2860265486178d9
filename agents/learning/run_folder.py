"""A training run: what is trained, with which settings and seed, and where its files go."""

from __future__ import annotations

import json
import os
import platform
import sys
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from agents.files import write_text
from agents.learning.settings import AlgorithmSettings

RECORD = "run.json"
"""Name of the file in a run's folder that says what run it is."""
PACKAGES = ("elbow-gym", "stable-baselines3", "torch", "gymnasium", "numpy", "numba")


@dataclass(frozen=True, kw_only=True)
class Run:
    """One seed of one algorithm in one environment."""

    algorithm: str
    """ "ppo" or "sac"."""
    environment: dict[str, Any]
    """Arguments of the environment, JSON types only; evaluations use them as they are."""
    settings: AlgorithmSettings
    """The algorithm's."""
    seed: int
    """Of networks, sampling and arms."""
    folder: Path
    """Where everything goes."""
    env: str = "ElbowArm-v0"
    """The environment's id."""
    minutes: float | None = None
    """The training ends after so many, evaluations and earlier sessions counted in; no limit when None."""
    checkpoint_seconds: float = 60.0
    """Time between two checkpoints [s]: a killed run loses no more."""
    initial_policy: Path | None = None
    """The policy whose weights the actor starts from."""

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.folder.name

    def card(self, training: dict[str, Any]) -> dict[str, Any]:
        """The arguments of `policy_of` that tell how the policy was made; `training` says how far it has come."""
        own = {"seed": self.seed, **training, "machine": machine()}
        if self.initial_policy is not None:
            own["initial_policy"] = self.initial_policy.name
        return {
            "command": " ".join(["python -m agents", *sys.argv[1:]]),
            "env": self.env,
            "training": {**asdict(self.settings), **own},
            "versions": versions(),
        }

    def record(self) -> dict[str, Any]:
        """What makes the run the run that it is, JSON types only."""
        plain = {
            "algorithm": self.algorithm,
            "env": self.env,
            "environment": self.environment,
            "settings": asdict(self.settings),
            "seed": self.seed,
            "initial_policy": None if self.initial_policy is None else str(self.initial_policy),
        }
        return json.loads(json.dumps(plain))


def open_run(folder: Path, record: dict[str, Any], resume: bool) -> None:
    """Writes a run's record into a new folder as run.json, or checks that the folder's is the same.

    Raises:
        ValueError: as `check_run` does.
    """
    check_run(folder, record, resume)
    if not (folder / RECORD).is_file():
        write_text(folder / RECORD, json.dumps(record, indent=2) + "\n")


def check_run(folder: Path, record: dict[str, Any], resume: bool) -> None:
    """Checks that a folder is free for a run, or holds the same one and it is resumed.

    Args:
        folder: the run's.
        record: what makes the run the run that it is, JSON types only.
        resume: whether it goes on.

    Raises:
        ValueError: there is a run and it is not resumed, it had other settings, or it does not say which.
    """
    path = folder / RECORD
    if not path.is_file():
        if (folder / "result.json").exists():
            raise ValueError(f"output must be free of runs without {RECORD}, got {folder}")
        return
    if not resume:
        raise ValueError(f"output must be free of earlier runs, or --resume be given, got {folder}")
    before, now = flat(json.loads(path.read_text(encoding="utf-8"))), flat(record)
    for name in {**before, **now}:
        if before.get(name) != now.get(name):
            raise ValueError(
                f"{name} of a resumed run must be {before.get(name)!r} as in {path}, got {now.get(name)!r}"
            )


def machine() -> str:
    """A word on the machine, for the cards of policies."""
    return f"{platform.machine()}, {os.cpu_count()} cores"


def versions() -> dict[str, str]:
    """Of the packages that a training depends on."""
    return {name: version(name) for name in PACKAGES}


def flat(plain: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """A dict of dicts as one dict with dotted names."""
    result: dict[str, Any] = {}
    for name, value in plain.items():
        inside = flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {f"{prefix}{name}": value}
        result.update(inside)
    return result

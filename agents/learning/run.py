"""A training run: algorithm, environment, settings, seed and folder, and the record that tells it from others."""

from __future__ import annotations

import json
import math
import platform
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from agents.learning.run_folder import RunFolder
from agents.learning.settings import AlgorithmSettings
from agents.workers import cores

PACKAGES = ("elbow-gym", "stable-baselines3", "torch", "gymnasium", "numpy", "numba", "scipy")
"""Packages that a training's outcome depends on; compiled products of matrices are SciPy's."""


@dataclass(frozen=True, kw_only=True)
class Run:
    """One seed of one algorithm in one environment. Raises ValueError naming the argument, the rule and the value."""

    algorithm: str
    """Name of the algorithm, "ppo" or "sac"."""
    environment: dict[str, Any]
    """Arguments of the environment, JSON types only; evaluations use them unchanged."""
    settings: AlgorithmSettings
    """Settings of the algorithm."""
    seed: int
    """Seed of the networks, the sampling and the arms, at least 0."""
    folder: Path
    """Folder of the run's files, see `RunFolder`."""
    env: str = "ElbowArm-v0"
    """Gymnasium id of the environment."""
    minutes: float | None = None
    """Longest duration of the training [min], evaluations and earlier sessions included; no limit when None."""
    checkpoint_seconds: float = 60.0
    """Time between two checkpoints [s]; a killed run loses no more than that."""
    initial_policy: Path | None = None
    """Policy whose weights the actor starts from; random weights, or those of a demonstration, when None."""
    command: str = ""
    """Command line that started the run, for the cards of its policies."""

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ValueError(f"seed must not be negative, got {self.seed}")
        if self.minutes is not None and not self.minutes > 0.0:
            raise ValueError(f"minutes must be positive, got {self.minutes}")
        if not 0.0 <= self.checkpoint_seconds < math.inf:
            raise ValueError(f"checkpoint_seconds must be finite and not negative, got {self.checkpoint_seconds}")

    @property
    def files(self) -> RunFolder:
        """The run's files."""
        return RunFolder(self.folder)

    @property
    def name(self) -> str:
        """Name of the run, which is its folder's."""
        return self.folder.name

    def card(self, training: dict[str, Any]) -> dict[str, Any]:
        """Arguments of `policy_of` that tell how the policy was made.

        Args:
            training: how far the training has come, JSON types only.
        """
        own = {"seed": self.seed, **training, "machine": machine()}
        if self.initial_policy is not None:
            own["initial_policy"] = self.initial_policy.name
        return {
            "command": self.command,
            "env": self.env,
            "training": {**asdict(self.settings), **own},
            "versions": versions(),
        }

    def record(self) -> dict[str, Any]:
        """Everything that a resumed run must have in common with the one it goes on from, JSON types only."""
        plain = {
            "algorithm": self.algorithm,
            "env": self.env,
            "environment": self.environment,
            "settings": asdict(self.settings),
            "seed": self.seed,
            "initial_policy": None if self.initial_policy is None else str(self.initial_policy),
        }
        return json.loads(json.dumps(plain))


def machine() -> str:
    """Architecture of this machine and number of cores that may be used, for the cards of policies."""
    return f"{platform.machine()}, {cores()} cores"


def versions() -> dict[str, str]:
    """Versions of `PACKAGES` by name."""
    return {name: version(name) for name in PACKAGES}

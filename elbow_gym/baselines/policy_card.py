"""Card of a policy: everything about it but its weights, checked entry by entry."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, cast

from elbow_gym.task.observation import OBSERVATION_VERSION

FORMAT = 2
"""Version of a policy's files: since 2 the digest covers the card's entries that decide what the policy does."""
ACCOUNT = ("algorithm", "command", "digest", "training", "evaluation", "versions")
"""Entries that tell how the policy came about; the digest covers all others."""


@dataclass(frozen=True)
class PolicyCard:
    """Everything about a policy but its weights. Raises ValueError naming an entry of the wrong type."""

    algorithm: str
    """Name of the algorithm, such as "ppo"."""
    environment: dict[str, Any]
    """Arguments of the environment in training, the fields of `Settings`, JSON types only."""
    observation: tuple[str, ...]
    """Names and units of the observation's entries."""
    layers: tuple[int, ...]
    """Numbers of units in the layers, from the observation to the action."""
    activation: str
    """Activation function between the layers, one of `elbow_gym.baselines.policy.ACTIVATIONS`."""
    command: str
    """Command line that trained the policy."""
    env: str = "ElbowArm-v0"
    """Gymnasium id of the environment in training."""
    output: str = "clip"
    """Function after the last layer, one of `elbow_gym.baselines.policy.OUTPUTS`."""
    digest: str = ""
    """SHA-256 of the weights and of the entries but for `ACCOUNT`; filled in when empty."""
    observation_version: int = OBSERVATION_VERSION
    """Version of the observation's entries in training."""
    format: int = FORMAT
    """Version of the files' format."""
    training: dict[str, Any] = field(default_factory=dict[str, Any])
    """Settings, seed and length of the training, JSON types only."""
    evaluation: dict[str, Any] = field(default_factory=dict[str, Any])
    """Metrics by name at the evaluation that chose the policy."""
    versions: dict[str, str] = field(default_factory=dict[str, str])
    """Versions of the libraries by name."""

    def __post_init__(self) -> None:
        for name, kind in (
            *((name, str) for name in ("algorithm", "activation", "command", "env", "output", "digest")),
            *((name, dict) for name in ("environment", "training", "evaluation", "versions")),
            *((name, int) for name in ("observation_version", "format")),
        ):
            if not isinstance(getattr(self, name), kind):
                kind_name = {str: "a text", dict: "an object", int: "an integer"}[kind]
                raise ValueError(f"{name} of a policy card must be {kind_name}, got {getattr(self, name)!r}")
        if self.format != FORMAT:
            raise ValueError(f"format of the policy must be {FORMAT}, got {self.format}")
        if not all(isinstance(name, str) for name in self.observation):
            raise ValueError(f"observation of a policy card must be names, got {self.observation!r}")
        if len(self.layers) < 2 or not all(isinstance(size, int) and size > 0 for size in self.layers):
            raise ValueError(f"layers of a policy card must be at least two positive integers, got {self.layers!r}")

    @property
    def deciding(self) -> str:
        """The entries that decide what the policy does, as JSON with sorted names."""
        return json.dumps({name: value for name, value in asdict(self).items() if name not in ACCOUNT}, sort_keys=True)


def read_card(path: Path) -> PolicyCard:
    """The card in a JSON file. Raises ValueError naming the file when it is cut, altered or of another kind."""
    try:
        loaded: object = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(loaded, dict):
            raise ValueError(f"a JSON object must be there, got {type(loaded).__name__}")
        plain = cast("dict[str, Any]", loaded)
        known = {one.name for one in fields(PolicyCard)}
        if unknown := sorted(set(plain) - known):
            raise ValueError(f"unknown entry {unknown[0]!r}")
        plain |= {name: tuple(plain[name]) for name in ("layers", "observation")}
        return PolicyCard(**plain)
    except (TypeError, KeyError, ValueError, RecursionError) as error:
        reason = f"no {error}" if isinstance(error, KeyError) else error
        raise ValueError(f"policy card must hold the fields of PolicyCard, got {path}: {reason}") from error

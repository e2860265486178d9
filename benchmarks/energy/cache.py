"""Results of single cells on disk, with which an interrupted benchmark goes on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.files import write_whole

ROOT = Path(__file__).parents[2]
CODE = ("elbow_gym/**/*.py", "agents/control/*.py", "agents/evaluation/*.py", "agents/tasks.py")
"""Patterns of the files that the results depend on."""
PICTURES = "rendering"
"""Folder of elbow_gym that only draws, so that no result depends on it."""

Results = dict[str, dict[str, NDArray[np.float64]]]


def key(question: Mapping[str, Any]) -> str:
    """Name of a result: digest of its question, in JSON types, and of the code."""
    text = json.dumps(question, sort_keys=True)
    return hashlib.sha256(f"{code()}{text}".encode()).hexdigest()[:32]


@cache
def code() -> str:
    """Digest of the files of `CODE`."""
    digest = hashlib.sha256()
    for pattern in CODE:
        for path in sorted(ROOT.glob(pattern)):
            if path.parent.name != PICTURES:
                digest.update(path.read_bytes())
    return digest.hexdigest()


def load(name: str, folder: Path) -> Results | None:
    """Stored result with a key, or None."""
    path = folder / f"{name}.npz"
    if not path.is_file():
        return None
    results: Results = {}
    with np.load(path, allow_pickle=False) as arrays:
        for entry in arrays.files:
            regime, metric = entry.split("/", 1)
            results.setdefault(regime, {})[metric] = arrays[entry]
    return results


def store(name: str, results: Results, folder: Path) -> None:
    """Stores a result under its key."""
    arrays = {f"{regime}/{metric}": array for regime, of in results.items() for metric, array in of.items()}
    write_whole(folder / f"{name}.npz", lambda temporary: np.savez(temporary, **arrays))

"""Results of single cells on disk, with which an interrupted benchmark goes on."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.files import read_arrays, write_whole
from agents.machine import code

MAY_BE_MISSING = "smallest_elbow_force"
"""Metric that a run without elbows has as NaN."""
Results = dict[str, dict[str, NDArray[np.float64]]]


def key(question: Mapping[str, Any]) -> str:
    """Name of a result: digest of its question, in JSON types, and of the code."""
    text = json.dumps(question, sort_keys=True)
    return hashlib.sha256(f"{code()}{text}".encode()).hexdigest()[:32]


def load(name: str, folder: Path) -> Results | None:
    """Stored result with a key; None when there is none, and with a line on stderr when it is damaged."""
    path = folder / f"{name}.npz"
    results: Results = {}
    try:
        for entry, array in read_arrays(path).items():
            regime, _, metric = entry.partition("/")
            if metric != MAY_BE_MISSING and not np.isfinite(array).all():
                raise ValueError(f"{path} must hold finite numbers, got {array[~np.isfinite(array)][0]} in {entry}")
            results.setdefault(regime, {})[metric] = array
    except FileNotFoundError:
        return None
    except ValueError as error:
        print(f"{error}; it is measured again", file=sys.stderr)
        return None
    return results


def store(name: str, results: Results, folder: Path) -> None:
    """Stores a result under its key."""
    arrays = {f"{regime}/{metric}": array for regime, of in results.items() for metric, array in of.items()}
    write_whole(folder / f"{name}.npz", lambda temporary: np.savez(temporary, **arrays))

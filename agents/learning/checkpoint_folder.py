"""Folder of a checkpoint of a training run: its files, with the checksum of each; see `agents.learning.run_folder`."""

from __future__ import annotations

import hashlib
import json
import pickle
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.files import read_json, write_folder
from agents.learning.actor import files_of
from agents.tasks import BEST
from elbow_gym.baselines.policy import Policy, pair, read_policy

PROGRESS, MODEL, BUFFER, STATE = "progress.json", "model.zip", "replay_buffer.npz", "state.pkl"
CHECKSUMS = "checksums.json"


class Checkpoint:
    """Checkpoint as it was saved, whose files are read when they are asked for.

    Args:
        path: folder of the checkpoint.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def damage(self) -> Path | None:
        """The first file that is missing or not as it was written; None when all are."""
        try:
            sums = read_json(self.path / CHECKSUMS)
        except (FileNotFoundError, ValueError):
            return self.path / CHECKSUMS
        for name in dict.fromkeys((PROGRESS, MODEL, STATE, *sums)):
            path = self.path / name
            if not path.is_file() or sums.get(name) != _checksum(path):
                return path
        return None

    @property
    def model(self) -> Path:
        """File of networks and optimisers, for Stable-Baselines3's `load`."""
        return self.path / MODEL

    def progress(self) -> dict[str, Any]:
        """Control periods, seconds and evaluations so far and the libraries' versions, JSON types only."""
        return read_json(self.path / PROGRESS)

    def best(self) -> Policy | None:
        """Policy with the best return at the checkpoint; None when none had been evaluated."""
        return read_policy(self.path / BEST) if pair(self.path / BEST)[0].is_file() else None

    def state(self) -> dict[str, Any]:
        """Environment, episode statistics and random generators, unpickled."""
        with (self.path / STATE).open("rb") as handle:
            return pickle.load(handle)

    def buffer(self) -> Iterator[tuple[str, NDArray[Any]]]:
        """Names and arrays of the replay buffer, one after the other, since each is large; nothing without a buffer."""
        if (self.path / BUFFER).is_file():
            with np.load(self.path / BUFFER, allow_pickle=False) as arrays:
                for name in arrays.files:
                    yield name, arrays[name]


def write_checkpoint(
    target: Path,
    model: bytes,
    buffer: Mapping[str, NDArray[Any]] | None,
    state: Mapping[str, Any],
    progress: Mapping[str, Any],
    best: Policy | None,
) -> None:
    """Writes a checkpoint, whole or not at all.

    Args:
        target: folder of the checkpoint, which must not hold anything.
        model: networks and optimisers, as Stable-Baselines3 saves them.
        buffer: arrays of the replay buffer by name; None for algorithms without one.
        state: environment, episode statistics and random generators; it is pickled.
        progress: control periods, seconds and evaluations so far and the libraries' versions, JSON types only.
        best: policy with the best return so far; None when none was evaluated.
    """

    def write(folder: Path) -> None:
        (folder / MODEL).write_bytes(model)
        if buffer is not None:
            np.savez(folder / BUFFER, **buffer)
        with (folder / STATE).open("wb") as handle:
            pickle.dump(dict(state), handle)
        (folder / PROGRESS).write_text(json.dumps(dict(progress), indent=2), encoding="utf-8")
        if best is not None:
            for path, content in files_of(best, folder / BEST).items():
                path.write_bytes(content)
        sums = {path.name: _checksum(path) for path in sorted(folder.iterdir())}
        (folder / CHECKSUMS).write_text(json.dumps(sums, indent=2), encoding="utf-8")

    write_folder(target, write)


def _checksum(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as handle:
        while block := handle.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()

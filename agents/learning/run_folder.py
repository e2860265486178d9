"""Files of a training run: their names and their formats, each read whole and written whole or not at all.

    run.json                       record of what is trained: algorithm, environment, settings, seed
    best.json, best.safetensors    policy with the best return so far
    evaluations.csv                one row per evaluation, `agents.learning.evaluation.COLUMNS`
    checkpoint_STEPS/              state that a killed run goes on from
        progress.json              control periods and seconds so far
        model.zip                  networks and optimisers, as Stable-Baselines3 saves them
        replay_buffer.npz          filled part of the replay buffer, of algorithms that have one
        state.pkl                  environment, episode statistics and random generators
    tensorboard/                   logs, written by Stable-Baselines3
    result.json                    outcome of the training

model.zip and state.pkl hold pickles, and whoever writes a pickle can run code where it is read: resume only runs of
your own. The policies hold none, see `elbow_gym.baselines.policy`.
"""

from __future__ import annotations

import csv
import json
import math
import pickle
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.files import copy_whole, write_csv, write_folder, write_text
from agents.learning.actor import copy_policy, save_policy
from agents.learning.evaluation import COLUMNS
from elbow_gym.baselines.policy import Policy, pair, read_policy

RECORD, RESULT, EVALUATIONS, BEST, TENSORBOARD = "run.json", "result.json", "evaluations.csv", "best", "tensorboard"
CHECKPOINT = "checkpoint_"
"""Start of a checkpoint's name; the control periods so far follow."""
PROGRESS, MODEL, BUFFER, STATE = "progress.json", "model.zip", "replay_buffer.npz", "state.pkl"


class Checkpoint:
    """Checkpoint as it was saved, whose files are read when they are asked for.

    Args:
        path: folder of the checkpoint.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def model(self) -> Path:
        """File of networks and optimisers, for Stable-Baselines3's `load`."""
        return self.path / MODEL

    def progress(self) -> dict[str, Any]:
        """Control periods and seconds so far, JSON types only."""
        return _read_json(self.path / PROGRESS)

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


class RunFolder:
    """Folder of a training run, through which each of its files is read and written.

    Args:
        path: the folder; it need not exist yet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def name(self) -> str:
        """Name of the run, ALGORITHM[_LABEL]_TASK_seedK where the command line made it."""
        return self.path.resolve().name

    @property
    def tensorboard(self) -> Path:
        """Folder of the TensorBoard logs."""
        return self.path / TENSORBOARD

    def check(self, record: Mapping[str, Any], resume: bool) -> None:
        """Checks that the folder is free for a run, or holds the same one and it is resumed.

        Args:
            record: what tells the run from others, JSON types only.
            resume: whether a run in the folder goes on.

        Raises:
            ValueError: there is a run and it is not resumed, it had other settings, or it does not say which.
        """
        path = self.path / RECORD
        if not path.is_file():
            if (self.path / RESULT).exists():
                raise ValueError(f"output must be free of runs without {RECORD}, got {self.path}")
            return
        if not resume:
            raise ValueError(f"output must be free of earlier runs, or --resume be given, got {self.path}")
        before, now = _flat(_read_json(path)), _flat(record)
        for name in {**before, **now}:
            if before.get(name) != now.get(name):
                raise ValueError(
                    f"{name} of a resumed run must be {before.get(name)!r} as in {path}, got {now.get(name)!r}"
                )

    def open(self, record: Mapping[str, Any], resume: bool) -> None:
        """Writes the record of a new run, or checks that the folder's is the same. Arguments and errors of `check`."""
        self.check(record, resume)
        if not (self.path / RECORD).is_file():
            _write_json(self.path / RECORD, record)

    def result(self) -> dict[str, Any] | None:
        """Outcome of the training; None as long as there is none."""
        path = self.path / RESULT
        return _read_json(path) if path.is_file() else None

    def write_result(self, result: Mapping[str, Any]) -> None:
        """Writes the outcome of the training, JSON types only."""
        _write_json(self.path / RESULT, result)

    def evaluations(self, last: float = math.inf) -> list[list[float]]:
        """Rows of `COLUMNS` up to `last` control periods; a resumed run measures later ones again."""
        path = self.path / EVALUATIONS
        if not path.is_file():
            return []
        with path.open(newline="", encoding="utf-8") as handle:
            rows = [[float(cell) for cell in row] for row in list(csv.reader(handle))[1:]]
        return [row for row in rows if row[0] <= last]

    def write_evaluations(self, rows: Iterable[Sequence[float]]) -> None:
        """Writes all rows of `COLUMNS`."""
        header = [f"{name} [{unit}]" for name, unit in COLUMNS.items()]
        write_csv(self.path / EVALUATIONS, header, ([f"{value:.10g}" for value in row] for row in rows))

    def copy_evaluations(self, target: Path) -> None:
        """Copies evaluations.csv, whole."""
        copy_whole(self.path / EVALUATIONS, target)

    def best(self) -> Policy | None:
        """Policy with the best return so far; None when there is none, or a kill came between its two files."""
        try:
            return read_policy(self.path / BEST) if pair(self.path / BEST)[0].is_file() else None
        except ValueError:
            return None

    def write_best(self, policy: Policy) -> None:
        """Writes the policy with the best return so far."""
        save_policy(policy, self.path / BEST)

    def best_size(self) -> int:
        """Size of the best policy's two files together [B]."""
        return sum(path.stat().st_size for path in pair(self.path / BEST))

    def copy_best(self, target: Path) -> None:
        """Copies the best policy's two files, as `copy_policy` does."""
        copy_policy(self.path / BEST, target)

    def checkpoint(self) -> Checkpoint | None:
        """The latest checkpoint; None when there is none."""
        found = self._checkpoints()
        return Checkpoint(found[-1]) if found else None

    def write_checkpoint(
        self,
        steps: int,
        save_model: Callable[[Path], Any],
        buffer: Mapping[str, NDArray[Any]] | None,
        state: Mapping[str, Any],
        progress: Mapping[str, Any],
    ) -> None:
        """Writes a checkpoint and removes the older ones; one of the same number of control periods stays as it is.

        Args:
            steps: control periods of the training so far.
            save_model: writes networks and optimisers into the file that it is given.
            buffer: arrays of the replay buffer by name; None for algorithms without one.
            state: environment, episode statistics and random generators; it is pickled.
            progress: control periods and seconds so far, JSON types only.
        """
        target = self.path / f"{CHECKPOINT}{steps:012d}"
        if target.exists():
            return

        def write(folder: Path) -> None:
            save_model(folder / MODEL)
            if buffer is not None:
                np.savez(folder / BUFFER, **buffer)
            with (folder / STATE).open("wb") as handle:
                pickle.dump(dict(state), handle)
            _write_json(folder / PROGRESS, progress)

        write_folder(target, write)
        # Unfinished folders are those of killed runs.
        for old in [*self.path.glob(f".{CHECKPOINT}*"), *self._checkpoints()[:-1]]:
            shutil.rmtree(old, ignore_errors=True)

    def _checkpoints(self) -> list[Path]:
        """Folders of the checkpoints, the latest last."""
        return sorted(self.path.glob(f"{CHECKPOINT}*"))


def _read_json(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))


def _write_json(path: Path, plain: Mapping[str, Any]) -> None:
    write_text(path, json.dumps(dict(plain), indent=2) + "\n")


def _flat(plain: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """A dict of dicts as one dict with dotted names."""
    result: dict[str, Any] = {}
    for name, value in plain.items():
        inside = _flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {f"{prefix}{name}": value}
        result.update(inside)
    return result

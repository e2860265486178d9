"""Files of a training run: their names and their formats, each read whole and written whole or not at all.

    run.json                       record of what is trained: algorithm, environment, settings, seed
    best.json, best.safetensors    policy with the best return so far
    evaluations.csv                one row per evaluation, `agents.learning.evaluation.COLUMNS`
    checkpoint_STEPS/              state that a killed run goes on from; the last two are kept
        checksums.json             SHA-256 of each of the other files
        progress.json              control periods, seconds and evaluations so far, versions of the libraries
        model.zip                  networks and optimisers, as Stable-Baselines3 saves them
        replay_buffer.npz          filled part of the replay buffer, of algorithms that have one
        state.pkl                  environment, episode statistics and random generators
        best.json, .safetensors    policy with the best return at the checkpoint
    tensorboard/                   logs, written by Stable-Baselines3
    result.json                    outcome of the training

model.zip and state.pkl hold pickles, and whoever writes a pickle can run code where it is read. The checksums find
damage, not malice, since whoever alters a file can alter its checksum: never resume a run folder that a stranger gave
you. The policies hold no pickles, see `elbow_gym.baselines.policy`.
"""

from __future__ import annotations

import csv
import errno
import shutil
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from agents.files import copy_whole, read_json, write_csv, write_json
from agents.learning.actor import copy_policy, save_policy
from agents.learning.checkpoint_folder import Checkpoint, write_checkpoint
from agents.learning.evaluation import COLUMNS
from agents.tasks import BEST
from elbow_gym.baselines.policy import Policy, pair, read_policy

RECORD, RESULT, EVALUATIONS, TENSORBOARD = "run.json", "result.json", "evaluations.csv", "tensorboard"
CHECKPOINT = "checkpoint_"
"""Start of a checkpoint's name; the control periods so far follow."""
KEPT = 2
"""Number of checkpoints that are kept, so that damage to the last one costs little."""


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
            ValueError: there is a run and it is not resumed, had other settings, or has no record or a damaged one.
        """
        path = self.path / RECORD
        if not path.is_file():
            if (self.path / RESULT).exists():
                raise ValueError(f"output must be free of runs without {RECORD}, got {self.path}")
            return
        if not resume:
            raise ValueError(f"output must be free of earlier runs, or --resume be given, got {self.path}")
        before, now = _flat(read_json(path)), _flat(record)
        for name in {**before, **now}:
            if before.get(name) != now.get(name):
                raise ValueError(
                    f"{name} of a resumed run must be {before.get(name)!r} as in {path}, got {now.get(name)!r}"
                )

    def open(self, record: Mapping[str, Any], resume: bool) -> None:
        """Writes the record of a new run, or checks that the folder's is the same. Arguments and errors of `check`."""
        self.check(record, resume)
        if not (self.path / RECORD).is_file():
            write_json(self.path / RECORD, record)

    def result(self) -> dict[str, Any] | None:
        """Outcome of the training; None as long as there is none, and with a line on stderr when it is damaged."""
        try:
            return read_json(self.path / RESULT)
        except FileNotFoundError:
            return None
        except ValueError as error:
            print(f"{error}; it counts as missing", file=sys.stderr)
            return None

    def write_result(self, result: Mapping[str, Any]) -> None:
        """Writes the outcome of the training, JSON types only."""
        self._check_there()
        write_json(self.path / RESULT, result)

    def evaluations(self) -> list[list[float]]:
        """Rows of evaluations.csv; none without the file. ValueError naming it when it is damaged."""
        path = self.path / EVALUATIONS
        if not path.is_file():
            return []
        try:
            header, *lines = csv.reader(path.read_text(encoding="utf-8").splitlines())
            rows = [[float(cell) for cell in line] for line in lines]
        except ValueError as error:
            raise ValueError(f"{path} must hold numbers under a header, got {error}") from error
        for row in rows:
            if len(row) != len(header):
                raise ValueError(f"{path} must have {len(header)} numbers in each row, got {row}")
        return rows

    def write_evaluations(self, rows: Iterable[Sequence[float]]) -> None:
        """Writes all rows of `COLUMNS`."""
        self._check_there()
        header = [f"{name} [{unit}]" for name, unit in COLUMNS.items()]
        write_csv(self.path / EVALUATIONS, header, ([f"{value:.10g}" for value in row] for row in rows))

    def copy_evaluations(self, target: Path) -> None:
        """Copies evaluations.csv, whole."""
        copy_whole(self.path / EVALUATIONS, target)

    def best(self) -> Policy | None:
        """Policy with the best return so far; None when there is none. ValueError naming a file that is damaged."""
        return read_policy(self.path / BEST) if any(path.is_file() for path in pair(self.path / BEST)) else None

    def restore_best(self, checkpoint: Checkpoint) -> Policy | None:
        """The best policy; where its files are missing or damaged, the checkpoint's, which is written again."""
        saved = checkpoint.best()
        try:
            own, reason = self.best(), f"no {BEST}.json in {self.path}"
        except ValueError as error:
            own, reason = None, str(error)
        if own is not None or saved is None:
            return own
        print(f"{reason}; written again from {checkpoint.path.name}", file=sys.stderr)
        self.write_best(saved)
        return saved

    def write_best(self, policy: Policy) -> None:
        """Writes the policy with the best return so far."""
        self._check_there()
        save_policy(policy, self.path / BEST)

    def best_size(self) -> int:
        """Size of the best policy's two files together [B]."""
        return sum(path.stat().st_size for path in pair(self.path / BEST))

    def copy_best(self, target: Path) -> None:
        """Copies the best policy's two files, as `copy_policy` does."""
        copy_policy(self.path / BEST, target)

    def checkpoint(self) -> Checkpoint | None:
        """The latest checkpoint that is whole; None when there is none at all. A line on stderr names a damaged file.

        Raises:
            ValueError: there are checkpoints, and all are damaged.
        """
        damaged: list[Path] = []
        for path in reversed(self._checkpoints()):
            bad = Checkpoint(path).damage()
            if bad is None:
                for one in damaged:
                    print(f"{one} is damaged or missing; going on from {path.name}", file=sys.stderr)
                return Checkpoint(path)
            damaged.append(bad)
        if damaged:
            names = ", ".join(map(str, damaged))
            raise ValueError(f"a checkpoint of the run must be whole, got damaged or missing {names}")
        return None

    def write_checkpoint(
        self,
        steps: int,
        model: bytes,
        buffer: Mapping[str, NDArray[Any]] | None,
        state: Mapping[str, Any],
        progress: Mapping[str, Any],
        best: Policy | None = None,
    ) -> None:
        """Writes a checkpoint and keeps the one before it; a whole one of the same control periods stays as it is.

        Args:
            steps: control periods of the training so far.
            model: networks and optimisers, as Stable-Baselines3 saves them.
            buffer: arrays of the replay buffer by name; None for algorithms without one.
            state: environment, episode statistics and random generators; it is pickled.
            progress: control periods and seconds so far, JSON types only.
            best: policy with the best return so far; None when none was evaluated.
        """
        self._check_there()
        target = self.path / f"{CHECKPOINT}{steps:012d}"

        if not target.exists() or Checkpoint(target).damage() is not None:
            shutil.rmtree(target, ignore_errors=True)
            write_checkpoint(target, model, buffer, state, progress, best)
        # Later ones are damaged, or of a past that did not come again.
        found = self._checkpoints()
        kept = [path for path in found if path <= target][-KEPT:]
        for old in (path for path in found if path not in kept):
            shutil.rmtree(old, ignore_errors=True)
        self._sweep()

    def _check_there(self) -> None:
        """FileNotFoundError where the folder that the run began in has gone."""
        if not (self.path / RECORD).is_file():
            raise FileNotFoundError(errno.ENOENT, f"the run's folder is gone, or its {RECORD}", str(self.path))

    def _sweep(self) -> None:
        """Removes what a killed run has left under temporary names."""
        for rest in self.path.glob(".*"):
            if rest.is_dir():
                shutil.rmtree(rest, ignore_errors=True)
            else:
                rest.unlink(missing_ok=True)

    def _checkpoints(self) -> list[Path]:
        """Folders of the checkpoints, the latest last."""
        return sorted(self.path.glob(f"{CHECKPOINT}*"))


def _flat(plain: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """A dict of dicts as one dict with dotted names."""
    result: dict[str, Any] = {}
    for name, value in plain.items():
        inside = _flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {f"{prefix}{name}": value}
        result.update(inside)
    return result

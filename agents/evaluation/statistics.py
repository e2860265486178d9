"""Statistics of a `VecNormalize` that Stable-Baselines3 keeps in a file of its own beside a model's .zip."""

from __future__ import annotations

import pickle
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

CIRCULAR = ("target_angle_cos", "target_angle_sin")
"""Entries of the observation whose squares add up to 1, and behind a `VecNormalize` do not."""
SLACK = 0.2
"""Difference from 1 up to which they are taken to [-]: they carry noise, and statistics may be some updates younger."""


@dataclass(frozen=True)
class Statistics:
    """Means and scales by which a `VecNormalize` changed the observations of a training."""

    mean: NDArray[np.float64]
    scale: NDArray[np.float64]
    limit: float
    """Largest magnitude of a changed entry [-]."""

    @classmethod
    def read(cls, path: Path, size: int) -> Statistics | None:
        """The statistics in a file of `VecNormalize.save`, a trusted one; None where it left observations as they are.

        Raises ValueError where the file holds something else, or statistics of observations of another size.
        """
        try:
            with path.open("rb") as file:
                saved = pickle.load(file)
            if not saved.norm_obs:
                return None
            mean, variance = (np.asarray(getattr(saved.obs_rms, name), dtype=np.float64) for name in ("mean", "var"))
            found = cls(mean, np.sqrt(variance + saved.epsilon), float(saved.clip_obs))
        # A damaged pickle, or one of what is not installed, raises nearly anything.
        except Exception as error:
            raise ValueError(f"{path} must hold the statistics of a VecNormalize, got: {error}") from error
        if mean.shape != (size,):
            raise ValueError(f"{path} must hold statistics of {size} entries, got shape {mean.shape}")
        return found

    def changed(self, observation: NDArray[Any]) -> NDArray[np.float32]:
        """Observations (..., size) as the training had them."""
        scaled = (observation - self.mean) / self.scale
        return np.clip(scaled, -self.limit, self.limit).astype(np.float32)

    def original(self, changed: NDArray[Any]) -> NDArray[np.float64]:
        """Observations (..., size) of the environment, from those of the training, where none was at the limit."""
        return changed * self.scale + self.mean


class Normalised:
    """Controller whose policy was trained on changed observations.

    Args:
        policy: what acts; its `predict` takes changed observations.
        statistics: how they are changed.
    """

    def __init__(self, policy: Any, statistics: Statistics) -> None:
        self._policy, self._statistics = policy, statistics

    def predict(self, observation: NDArray[np.float32], **options: Any) -> tuple[Any, Any]:
        """Actions (B, n) for observations (B, size) of the environment, and the policy's state."""
        return self._policy.predict(self._statistics.changed(observation), **options)


def statistics_file(path: Path) -> Path | None:
    """File of the statistics beside a model's .zip, under the names that callbacks and RL Zoo use; None without one."""
    # Stable-Baselines3's CheckpointCallback: rl_model_1000_steps.zip, rl_model_vecnormalize_1000_steps.pkl.
    checkpoint = re.sub(r"_(\d+_steps)$", r"_vecnormalize_\1", path.stem)
    names = (f"{checkpoint}.pkl",) if checkpoint != path.stem else (f"{path.stem}_vecnormalize.pkl", "vecnormalize.pkl")
    return next((file for name in names if (file := path.with_name(name)).is_file()), None)


def statistics_beside(path: Path, last: Any, names: Sequence[str]) -> Statistics | None:
    """The statistics that a model needs; None where it was trained on the environment's own observations.

    Args:
        path: the model's .zip, a trusted one: the statistics are a pickle, too.
        last: last observations of its training, as the .zip has them, (B, size); None where it has none.
        names: names of the entries of the environment's observation.

    Raises:
        ValueError: the training had other observations than the environment's, and no file beside the model says how
            they were changed, or the file is another training's.
    """
    seen = None if last is None else np.asarray(last, dtype=np.float64).reshape(-1, len(names))
    if seen is not None and _own(seen, names):
        return None
    file = statistics_file(path)
    found = None if file is None else Statistics.read(file, len(names))
    if seen is None or (found is not None and _own(found.original(seen), names)):
        return found
    raise ValueError(
        f"{path} must be trained on the environment's own observations or have the file of its VecNormalize beside it, "
        f"{path.stem}_vecnormalize.pkl or vecnormalize.pkl, got "
        f"{'none' if file is None else f'{file.name}, which is of another training'}"
    )


def _own(observation: NDArray[np.float64], names: Sequence[str]) -> bool:
    """Whether observations (B, size) can be the environment's, by the cosine and sine of the target's angle."""
    columns = [k for k, name in enumerate(names) if name.split()[0] in CIRCULAR]
    return bool(abs(np.median(np.square(observation[:, columns]).sum(axis=1)) - 1.0) < SLACK)

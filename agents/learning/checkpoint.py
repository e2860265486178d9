"""Checkpoints of a training: all that it needs to go on, in one folder that appears whole or not at all.

They hold pickles (Stable-Baselines3's zip and the random generators' states): load only checkpoints of your own runs.
Policies that are shipped hold none; see `elbow_gym.baselines.policy`.
"""

from __future__ import annotations

import json
import os
import pickle
import random
import shutil
from collections.abc import Mapping
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np

PREFIX = "checkpoint_"
BUFFER_ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


def save_checkpoint(folder: Path, model: Any, monitored: Any, progress: Mapping[str, Any]) -> Path:
    """Writes `folder`/checkpoint_STEPS and removes the older ones.

    Args:
        folder: the run's.
        model: Stable-Baselines3's.
        monitored: the `VecMonitor` over the `SB3VecEnv` that it trains in.
        progress: what else goes on, JSON types only.
    """
    import torch

    target = folder / f"{PREFIX}{model.num_timesteps:012d}"
    if target.exists():
        return target
    folder.mkdir(parents=True, exist_ok=True)
    temporary = Path(mkdtemp(dir=folder, prefix=f".{PREFIX}"))
    try:
        model.save(temporary / "model.zip")
        if getattr(model, "replay_buffer", None) is not None:
            _save_buffer(model.replay_buffer, temporary / "replay_buffer.npz")
        state = {
            "env": monitored.venv.env.get_state(),
            "returns": monitored.episode_returns.copy(),
            "lengths": monitored.episode_lengths.copy(),
            "torch": torch.get_rng_state(),
            "numpy": np.random.get_state(),  # noqa: NPY002  the global one is what SB3 draws from
            "python": random.getstate(),
        }
        with (temporary / "state.pkl").open("wb") as handle:
            pickle.dump(state, handle)
        (temporary / "progress.json").write_text(json.dumps(dict(progress), indent=2) + "\n", encoding="utf-8")
        os.replace(temporary, target)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    for other in folder.glob(f".{PREFIX}*"):
        shutil.rmtree(other, ignore_errors=True)
    for other in checkpoints(folder)[:-1]:
        shutil.rmtree(other, ignore_errors=True)
    return target


def checkpoints(folder: Path) -> list[Path]:
    """The checkpoints in a run's folder, the latest last."""
    return sorted(folder.glob(f"{PREFIX}*"))


def load_progress(checkpoint: Path) -> dict[str, Any]:
    """What was saved as `progress`."""
    return json.loads((checkpoint / "progress.json").read_text(encoding="utf-8"))


def load_checkpoint(checkpoint: Path, model_class: Any, monitored: Any) -> Any:
    """The model as it was, with the environment and all random generators set back to that moment.

    Args:
        checkpoint: of one's own run; it is unpickled.
        model_class: Stable-Baselines3's class.
        monitored: a `VecMonitor` over an `SB3VecEnv` like the one that was saved.
    """
    import torch

    model = model_class.load(checkpoint / "model.zip", env=monitored, device="cpu", force_reset=False)
    if (checkpoint / "replay_buffer.npz").is_file():
        _load_buffer(model.replay_buffer, checkpoint / "replay_buffer.npz")
    with (checkpoint / "state.pkl").open("rb") as handle:
        state = pickle.load(handle)
    monitored.venv.env.set_state(state["env"])
    monitored.episode_returns, monitored.episode_lengths = state["returns"], state["lengths"]
    torch.set_rng_state(state["torch"])
    np.random.set_state(state["numpy"])  # noqa: NPY002
    random.setstate(state["python"])
    return model


def _save_buffer(buffer: Any, path: Path) -> None:
    # The filled part alone: a large buffer is mostly empty for long.
    size = buffer.buffer_size if buffer.full else buffer.pos
    arrays = {name: getattr(buffer, name)[:size] for name in BUFFER_ARRAYS}
    np.savez(path, pos=buffer.pos, full=buffer.full, **arrays)


def _load_buffer(buffer: Any, path: Path) -> None:
    with np.load(path, allow_pickle=False) as arrays:
        for name in BUFFER_ARRAYS:
            getattr(buffer, name)[: len(arrays[name])] = arrays[name]
        buffer.pos, buffer.full = int(arrays["pos"]), bool(arrays["full"])

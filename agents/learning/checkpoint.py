"""State of a training between two steps: what a checkpoint takes from a model and gives back to it."""

from __future__ import annotations

import io
import platform
import random
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.learning.run import versions
from agents.learning.run_folder import Checkpoint, RunFolder
from elbow_gym.baselines.policy import Policy

BUFFER_ARRAYS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays of Stable-Baselines3's replay buffer."""


def save_checkpoint(
    folder: RunFolder, model: Any, monitored: Any, progress: Mapping[str, Any], best: Policy | None
) -> None:
    """Writes a checkpoint of the training as it is now.

    Args:
        folder: the run's.
        model: model of Stable-Baselines3.
        monitored: the `VecMonitor` over the `SB3VecEnv` that it trains in.
        progress: control periods, seconds and evaluations so far, JSON types only.
        best: policy with the best return so far.
    """
    import torch

    state = {
        "env": monitored.venv.env.get_state(),
        "returns": monitored.episode_returns.copy(),
        "lengths": monitored.episode_lengths.copy(),
        "torch": torch.get_rng_state(),
        "numpy": np.random.get_state(),  # noqa: NPY002  the global one is what SB3 draws from
        "python": random.getstate(),
    }
    buffer = getattr(model, "replay_buffer", None)
    arrays = None if buffer is None else _filled(buffer)
    # Into memory first: torch hides an operating system's error, such as that of a full disk.
    saved = io.BytesIO()
    model.save(saved)
    progress = {**progress, "versions": running()}
    folder.write_checkpoint(model.num_timesteps, saved.getvalue(), arrays, state, progress, best)


def buffer_size(model: Any) -> int:
    """Size of a model's replay buffer once it is full [B]; 0 without one."""
    buffer = getattr(model, "replay_buffer", None)
    return 0 if buffer is None else sum(getattr(buffer, name).nbytes for name in BUFFER_ARRAYS)


def running() -> dict[str, str]:
    """Versions that a training's bits depend on: Python's without its patch, and the libraries'."""
    return {"python": ".".join(platform.python_version_tuple()[:2]), **versions()}


def check_versions(checkpoint: Checkpoint) -> None:
    """Raises ValueError naming both versions where a checkpoint was saved by others than run now, as far as it says."""
    before, now = checkpoint.progress().get("versions", {}), running()
    for name, version in now.items():
        if before.get(name, version) != version:
            raise ValueError(
                f"{name} of a resumed run must be {before[name]} as when {checkpoint.path} was saved, got {version}"
            )


def load_checkpoint(checkpoint: Checkpoint, model_class: Any, monitored: Any) -> Any:
    """The model as it was, with the environment and all random generators set back to that moment.

    Args:
        checkpoint: of a run of your own, because it is unpickled.
        model_class: class of Stable-Baselines3's model.
        monitored: a `VecMonitor` over an `SB3VecEnv` like the one that was saved.
    """
    import torch

    model = model_class.load(checkpoint.model, env=monitored, device="cpu", force_reset=False)
    for name, array in checkpoint.buffer():
        _refill(model.replay_buffer, name, array)
    state = checkpoint.state()
    monitored.venv.env.set_state(state["env"])
    monitored.episode_returns, monitored.episode_lengths = state["returns"], state["lengths"]
    torch.set_rng_state(state["torch"])
    np.random.set_state(state["numpy"])  # noqa: NPY002
    random.setstate(state["python"])
    return model


def _filled(buffer: Any) -> dict[str, NDArray[Any]]:
    """The filled part of a replay buffer, since a large one is mostly empty for long, and where it goes on."""
    size = buffer.buffer_size if buffer.full else buffer.pos
    arrays = {name: getattr(buffer, name)[:size] for name in BUFFER_ARRAYS}
    return {"pos": np.array(buffer.pos), "full": np.array(buffer.full), **arrays}


def _refill(buffer: Any, name: str, array: NDArray[Any]) -> None:
    if name in BUFFER_ARRAYS:
        getattr(buffer, name)[: len(array)] = array
    else:
        setattr(buffer, name, array.item())

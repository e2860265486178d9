"""State trajectory at the control periods, as an optimisation writes it and controllers follow it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.files import read_arrays, write_whole
from elbow_gym.interface import Environment, Interface

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """States at the N + 1 ends of the control periods and the voltages held in between."""

    q: Array
    """Relative joint angles [rad], (N + 1, n)."""
    q_dot: Array
    """Rates of the joint angles [rad/s], (N + 1, n)."""
    current: Array
    """Armature currents [A], (N + 1, n)."""
    voltage: Array
    """Terminal voltages [V], (N, n)."""

    @property
    def states(self) -> Array:
        """(q, q_dot, current) at the ends of the control periods, (N + 1, 3n)."""
        return np.concatenate([self.q, self.q_dot, self.current], axis=-1)

    @classmethod
    def from_states(cls, states: Array, voltage: Array) -> Trajectory:
        """The trajectory of `states` [rad, rad/s, A], (N + 1, 3n), and voltages [V], (N, n)."""
        q, q_dot, current = np.split(states, 3, axis=-1)
        return cls(q, q_dot, current, voltage)

    def save(self, path: Path) -> None:
        """Writes a compressed .npz without pickles, whole or not at all."""
        arrays = {field.name: getattr(self, field.name) for field in fields(self)}
        write_whole(path, lambda temporary: np.savez_compressed(temporary, **arrays))

    @classmethod
    def load(cls, path: Path, beside: Collection[str] = ()) -> Trajectory:
        """Reads what `save` wrote. ValueError naming the file when it is cut, altered or holds what is not finite.

        Args:
            path: the .npz.
            beside: names of arrays that the file may hold beside those of a trajectory.
        """
        arrays = {name: array for name, array in read_arrays(path).items() if name not in beside}
        names = [field.name for field in fields(cls)]
        if set(arrays) != set(names):
            raise ValueError(f"{path} must hold the arrays {names}, got {sorted(arrays)}")
        periods, joints = arrays["voltage"].shape if arrays["voltage"].ndim == 2 else (0, 0)
        for name, array in arrays.items():
            shape = (periods, joints) if name == "voltage" else (periods + 1, joints)
            if array.shape != shape or array.dtype.kind != "f":
                raise ValueError(f"{name} in {path} must be numbers of shape {shape}, got {array.dtype} {array.shape}")
            if not np.isfinite(array).all():
                raise ValueError(f"{name} in {path} must be finite, got {array[~np.isfinite(array)][0]}")
        return cls(**arrays)


class OpenLoop:
    """Controller that plays the voltages of a trajectory open loop.

    Args:
        env: the environment that it will act in, at the trajectory's control frequency.
        trajectory: the voltages.
    """

    def __init__(self, env: Environment, trajectory: Trajectory) -> None:
        self._actions = Interface(env).action(trajectory.voltage)
        self._steps = 0

    def predict(
        self, observation: NDArray[np.float32], *_args: Any, **_kwargs: Any
    ) -> tuple[NDArray[np.float32], None]:
        """Actions of the next control period (..., n) for observations (..., size); the first starts an episode."""
        action = self._actions[self._steps]
        self._steps += 1
        return np.broadcast_to(action, (*observation.shape[:-1], action.size)).copy(), None

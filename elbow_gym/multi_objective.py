"""Environment of one arm with a vector reward, by MO-Gymnasium's conventions."""

from __future__ import annotations

from typing import Any, cast

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from elbow_gym.env import ElbowArmEnv
from elbow_gym.parameters import Array

WEIGHTS = ("tracking_weight", "energy_weight")


class MOElbowArmEnv(ElbowArmEnv):
    """`ElbowArmEnv` whose reward is `[-|hand - target|, -P]` in m and W, shape (2,), without weights.

    MO-Gymnasium's `LinearReward` with the weights of an `ElbowArmEnv` gives back exactly its reward. The arguments
    are those of `ElbowArmEnv` but the weights. `reward_space` and `reward_dim` are MO-Gymnasium's.
    """

    def __init__(self, **arguments: Any) -> None:
        for name in WEIGHTS:
            if name in arguments:
                raise ValueError(f"{name} must be left to the scalarisation of the reward, got {arguments[name]!r}")
        super().__init__(**arguments, tracking_weight=1.0, energy_weight=1.0)
        self.reward_space = cast("spaces.Space[Array]", spaces.Box(-np.inf, np.inf, (len(WEIGHTS),), np.float64))
        self.reward_dim = len(WEIGHTS)

    def step(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], Array, bool, bool, dict[str, Any]]:
        """One control period. Raises ValueError, with the state untouched, on a wrong shape or NaN."""
        observation, _, terminated, truncated, info = super().step(action)
        reward = np.array([info["reward_tracking"], info["reward_energy"]])
        return observation, reward, terminated, truncated, info

    def set_tracking_weight(self, tracking_weight: float) -> None:
        """Refused: the reward has no weights."""
        raise gym.error.Error(f"tracking_weight must be left to the scalarisation, got {tracking_weight!r}")

    def set_energy_weight(self, energy_weight: float) -> None:
        """Refused: the reward has no weights."""
        raise gym.error.Error(f"energy_weight must be left to the scalarisation, got {energy_weight!r}")

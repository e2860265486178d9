"""The training's environment: it also keeps the means of what the reward is made of, for TensorBoard."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elbow_gym.vector_env import ElbowArmVectorEnv

METERS = {"reward_tracking": "-", "reward_energy": "-", "tracking_error": "m", "electrical_power": "W"}
"""Entries of the step's info, and their units, of which the means over all arms and control periods are kept."""


class MeteredVectorEnv(ElbowArmVectorEnv):
    """`ElbowArmVectorEnv` with autoreset "SameStep" that sums up `METERS`. Takes its arguments."""

    def __init__(self, num_envs: int = 1, **arguments: Any) -> None:
        super().__init__(num_envs, **arguments, autoreset_mode="SameStep")
        self._sums = dict.fromkeys(METERS, 0.0)
        self.metered_periods = 0
        """Control periods since the last reading, of all arms together."""

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """One control period of every arm."""
        outcome = super().step(actions)
        info = outcome[4]
        for name in METERS:
            # An arm that has ended shows its fresh start in the info; its last step stands in the final one.
            self._sums[name] += float(info[name].sum())
            if "final_info" in info:
                self._sums[name] += float(info["final_info"][name].sum())
        self.metered_periods += self.num_envs
        return outcome

    def read_meters(self) -> dict[str, float]:
        """Means per control period since the last call; nothing when no step was made."""
        means = (
            {name: total / self.metered_periods for name, total in self._sums.items()} if self.metered_periods else {}
        )
        self._sums, self.metered_periods = dict.fromkeys(METERS, 0.0), 0
        return means

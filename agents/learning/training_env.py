"""Environment of a training: episodes that end at different times, and means of the reward's terms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elbow_gym.vector_env import ElbowArmVectorEnv

METERS = {"reward_tracking": "-", "reward_energy": "-", "tracking_error": "m", "electrical_power": "W"}
"""Units of those entries of the step's info whose means over all arms and control periods are kept."""

GROUPS = 16
"""Largest number of clocks among staggered arms: arms that end together start anew together, which costs as much as
one arm's reset does."""


class MeteredVectorEnv(ElbowArmVectorEnv):
    """`ElbowArmVectorEnv` with autoreset "SameStep" that sums up `METERS`.

    Args:
        num_envs: number of arms.
        arguments: those of `ElbowArmVectorEnv`.
    """

    def __init__(self, num_envs: int = 1, **arguments: Any) -> None:
        super().__init__(num_envs, **arguments, autoreset_mode="SameStep")
        self._sums = dict.fromkeys(METERS, 0.0)
        self.staggered = False
        """Whether a reset of all arms spreads the clocks of their first episodes evenly, in `GROUPS`. Episodes are
        equally long: otherwise all arms of a rollout show the same part of the task, and an update forgets the
        others."""
        self.metered_periods = 0
        """Number of control periods since the last reading, summed over all arms."""

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Resets as `ElbowArmVectorEnv.reset`; when `staggered`, arms of higher number have a shorter first episode."""
        observation, info = super().reset(seed=seed, options=options)
        if self.staggered and "reset_mask" not in (options or {}):
            state = self.get_state()
            groups = min(self.num_envs, GROUPS)
            group = np.arange(self.num_envs) * groups // self.num_envs
            state["episodes"]["steps"] = group * self.settings.horizon // groups
            self.set_state(state)
            observation = self.episodes.observe().observation
        return observation, info

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Makes one control period of every arm. Arguments and results of `ElbowArmVectorEnv.step`."""
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
        """Means of `METERS` per control period since the last call; empty when no step was made."""
        means = (
            {name: total / self.metered_periods for name, total in self._sums.items()} if self.metered_periods else {}
        )
        self._sums, self.metered_periods = dict.fromkeys(METERS, 0.0), 0
        return means

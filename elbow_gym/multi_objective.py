"""Environments with a vector reward, single and batched, by MO-Gymnasium's conventions."""

from __future__ import annotations

from typing import Any, cast

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from elbow_gym.env import ElbowArmEnv
from elbow_gym.parameters import Array
from elbow_gym.task.attributes import WEIGHTS, TaskAttributes
from elbow_gym.task.episodes import Episodes, Outcome
from elbow_gym.task.infos import Flags
from elbow_gym.task.reward import Price, early_end
from elbow_gym.vector_env import ElbowArmVectorEnv

# Without weights, the reward's terms are the tracking error in m and the power in W.
NO_WEIGHTS = dict.fromkeys(WEIGHTS, 1.0)


class Objectives(TaskAttributes):
    """Vector reward `[-|hand - target|, -P]` in m and W, without weights.

    `reward_space` is a `Box` of one arm's rewards, float64 (2,), and `reward_dim` is 2. Its lower ends are what an
    episode costs that leaves float64 in its first control period; its upper ends are no error, and the power that the
    motors can feed back, where it is credited.
    """

    reward_space: spaces.Space[Array]
    reward_dim = len(WEIGHTS)

    def set_tracking_weight(self, tracking_weight: float) -> None:
        """Refused: the reward has no weights."""
        raise gym.error.Error(f"tracking_weight must be left to the scalarisation, got {tracking_weight!r}")

    def set_energy_weight(self, energy_weight: float) -> None:
        """Refused: the reward has no weights."""
        raise gym.error.Error(f"energy_weight must be left to the scalarisation, got {energy_weight!r}")


def without_weights(arguments: dict[str, Any]) -> dict[str, Any]:
    """An environment's arguments with both weights at one. ValueError where they have a weight already."""
    for name in WEIGHTS:
        if name in arguments:
            raise ValueError(f"{name} must be left to the scalarisation of the reward, got {arguments[name]!r}")
    return {**arguments, **NO_WEIGHTS}


def reward_space(episodes: Episodes) -> spaces.Space[Array]:
    """`Box` of one arm's rewards [m, W], see `Objectives`, of the arms that `randomize` may draw."""
    settings, nominal = episodes.settings, episodes.population.nominal
    voltage = nominal["supply_voltage"] * max(1.0, settings.randomization.highest("supply_voltage"))
    resistance = nominal["armature_resistance"] * min(1.0, settings.randomization.lowest("armature_resistance"))
    price = Price(**NO_WEIGHTS, control_frequency=settings.control_frequency, regeneration=settings.regeneration)
    periods = np.array([settings.horizon, 1])
    worst = early_end(episodes.layout, np.full(2, voltage), np.tile(resistance, (2, 1)), price, periods)
    low = np.array([worst.tracking[0], worst.energy[0]])
    high = np.array([0.0, -worst.energy[1] if settings.regeneration else 0.0])
    return cast("spaces.Space[Array]", spaces.Box(low, high, dtype=np.float64))


class MOElbowArmEnv(Objectives, ElbowArmEnv):
    """`ElbowArmEnv` whose reward is `[-|hand - target|, -P]` in m and W, shape (2,), without weights.

    MO-Gymnasium's `LinearReward` with the weights of an `ElbowArmEnv` gives back exactly its reward. The arguments
    are those of `ElbowArmEnv` but the weights. `reward_space` and `reward_dim` are MO-Gymnasium's, see `Objectives`.
    """

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**without_weights(arguments))
        self.reward_space = reward_space(self.episodes)

    def step(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], Array, bool, bool, dict[str, Any]]:
        """One control period. Raises ValueError, with the state untouched, on a wrong shape or NaN."""
        observation, _, terminated, truncated, info = super().step(action)
        reward = np.array([info["reward_tracking"], info["reward_energy"]])
        return observation, reward, terminated, truncated, info


class MOElbowArmVectorEnv(Objectives, ElbowArmVectorEnv):
    """`MOElbowArmEnv` for `num_envs` arms at once: rewards of shape (num_envs, 2).

    The arguments are those of `ElbowArmVectorEnv` but the weights. `reward_space` is one arm's, as that of
    MO-Gymnasium's `MOSyncVectorEnv`.
    """

    def __init__(self, num_envs: int = 1, **arguments: Any) -> None:
        super().__init__(num_envs, **without_weights(arguments))
        self.reward_space = reward_space(self.episodes)

    def _play(self, actions: NDArray[np.float64], waiting: Flags | None) -> Outcome:
        outcome = super()._play(actions, waiting)
        return outcome._replace(
            reward=np.stack([outcome.info["reward_tracking"], outcome.info["reward_energy"]], axis=-1)
        )

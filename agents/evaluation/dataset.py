"""Minari data sets of whole episodes of any player, recorded on the native batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np
from gymnasium.error import DependencyNotInstalled

from agents.evaluation.player import Player
from elbow_gym.checks import non_negative, positive_integer
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

if TYPE_CHECKING:
    import minari

FIELDS = ("observations", "actions", "rewards", "terminations", "truncations")
"""Minari's names of an episode's arrays; there is one observation more than of the others."""


def record_episodes(player: Player, episodes: int, seed: int = 0, noise: float = 0.0) -> list[dict[str, Any]]:
    """Whole episodes of a player, each a dict of the arrays in FIELDS, up to its first terminated or truncated step.

    Args:
        player: player, with its environment.
        episodes: number of episodes, played side by side.
        seed: seed of the first episode's start; the others' follow. It also gives the noise.
        noise: standard deviation of normal noise on the actions, as a share of the largest action.

    Raises:
        ValueError: a number is out of its range.
    """
    count, share = positive_integer("episodes", episodes), non_negative("noise", noise)
    env = ElbowArmVectorEnv(count, autoreset_mode="Disabled", **player.settings.arguments)
    controller, high = player.make(env), env.single_action_space.high  # pyright: ignore[reportAttributeAccessIssue]
    generator = np.random.default_rng(seed)
    observations, steps = [env.reset(seed=seed)[0]], []
    length = np.zeros(count, dtype=np.int64)
    while not length.all():
        action = np.asarray(controller.predict(observations[-1])[0], dtype=np.float64)
        if share > 0.0:
            action = action + share * high * generator.standard_normal(action.shape)
        action = np.clip(action, -high, high).astype(np.float32)
        observation, reward, terminated, truncated, _ = env.step(action)
        steps.append((action, reward, terminated, truncated))
        observations.append(observation)
        length[(length == 0) & (terminated | truncated)] = len(steps)
    env.close()
    seen = np.stack(observations)
    taken = [np.stack(part) for part in zip(*steps, strict=True)]
    return [
        dict(zip(FIELDS, (seen[: n + 1, i], *(part[:n, i] for part in taken)), strict=True))
        for i, n in enumerate(length.tolist())
    ]


def write_dataset(player: Player, name: str, episodes: list[dict[str, Any]]) -> minari.MinariDataset:
    """Data set in Minari's folder, which the variable MINARI_DATASETS_PATH names.

    Args:
        player: player of the episodes.
        name: Minari's id of the data set, such as "elbow_gym/ppo-v0".
        episodes: result of `record_episodes`.

    Raises:
        ValueError: there is a data set of this name.
        DependencyNotInstalled: Minari is missing.
    """
    try:
        import minari
        from minari.data_collector import EpisodeBuffer
    except ImportError as error:
        raise DependencyNotInstalled('minari must be installed: pip install "minari[hdf5]" pillow') from error
    if name in minari.list_local_datasets():
        raise ValueError(f"name must be new among Minari's local data sets, got {name}")
    buffers = [EpisodeBuffer(id=i, **episode) for i, episode in enumerate(episodes)]
    env = gym.make("elbow_gym:ElbowArm-v0", **_spelled(player.settings))
    return minari.create_dataset_from_buffers(name, buffers, env=env, algorithm_name=player.label, author="elbow_gym")


def _spelled(settings: Settings) -> dict[str, Any]:
    """The arguments that are not the default ones, as JSON has them, since Minari stores them."""
    default = Settings().arguments
    told = {name: value for name, value in settings.arguments.items() if value != default[name]}
    return {name: value.to_dict() if hasattr(value, "to_dict") else value for name, value in told.items()}

"""Minari data set of a shipped policy, recorded on the native batch, and d3rlpy's behavioural cloning from it.

Pinned: minari[hdf5] 0.5.4, pillow 13.0.0, d3rlpy 2.8.1, torch 2.13.0, and after those gymnasium 1.4.0: d3rlpy asks for
1.0.0, which has no autoreset modes, and works with 1.4.0.
`python -m agents.recipes.minari_d3rlpy`

`replay_buffer` builds d3rlpy's data set by hand. Don't use `d3rlpy.datasets.get_minari`: Minari keeps one observation
more than actions in each episode, and get_minari strings the episodes together all the same, so that from the second
episode on each action is paired with the observation of an earlier instant, one more for each episode.
"""

from __future__ import annotations

from typing import Any

import d3rlpy
import gymnasium as gym
import minari
import numpy as np
from minari.data_collector import EpisodeBuffer

from agents.recipes.race import AfterUpdate, main
from agents.shipped.seeds import load_policy

DATASET = "elbow_gym/ppo-elbows2-v0"
GRADIENT_STEPS = 1000
"""Gradient steps between two evaluations."""


def record(episodes: int = 40, seed: int = 0, noise: float = 0.1) -> list[EpisodeBuffer]:
    """Whole episodes of the shipped PPO policy, with normal noise of a standard deviation of `noise` on its actions."""
    policy = load_policy("ppo", elbows=2)
    env = gym.make_vec("elbow_gym:ElbowArm-v0", episodes, autoreset_mode="Disabled", start_noise=0.1)
    generator = np.random.default_rng(seed)
    observations, steps = [env.reset(seed=seed)[0]], []
    over = np.zeros(episodes, dtype=bool)
    while not over.any():  # All episodes are equally long.
        action = policy.predict(observations[-1])[0]
        action = np.clip(action + noise * generator.standard_normal(action.shape), -1.0, 1.0).astype(np.float32)
        observation, reward, terminated, truncated, _ = env.step(action)
        steps.append((action, reward, terminated, truncated))
        observations.append(observation)
        over = terminated | truncated
    env.close()
    stacked = np.stack(observations), *(np.stack(parts) for parts in zip(*steps, strict=True))
    names = "observations", "actions", "rewards", "terminations", "truncations"
    return [EpisodeBuffer(id=i, **{n: x[:, i] for n, x in zip(names, stacked, strict=True)}) for i in range(episodes)]


def write(episodes: list[EpisodeBuffer], name: str = DATASET) -> minari.MinariDataset:
    """Data set in Minari's folder, which the variable MINARI_DATASETS_PATH names; one of the same name is replaced."""
    if name in minari.list_local_datasets():
        minari.delete_dataset(name)
    env = gym.make("elbow_gym:ElbowArm-v0")
    return minari.create_dataset_from_buffers(name, episodes, env=env, algorithm_name="PPO", author="elbow_gym")


def replay_buffer(dataset: minari.MinariDataset) -> d3rlpy.dataset.ReplayBuffer:
    """d3rlpy's data set from Minari's. A truncated episode gives one transition less than it has actions."""
    episodes = [
        d3rlpy.dataset.Episode(
            observations=np.asarray(episode.observations)[: len(episode.actions)],
            actions=episode.actions,
            rewards=np.asarray(episode.rewards, dtype=np.float32)[:, None],
            terminated=bool(episode.terminations[-1]),
        )
        for episode in dataset
    ]
    return d3rlpy.dataset.create_infinite_replay_buffer(episodes=episodes)


def train(steps: int = 10_000, seed: int = 0, after_update: AfterUpdate = lambda *_: False) -> Any:
    """Trains d3rlpy's BC for a number of gradient steps, which `after_update` counts in place of control periods."""
    d3rlpy.seed(seed)
    algorithm = d3rlpy.algos.BCConfig(batch_size=256).create(device="cpu")
    data = replay_buffer(write(record(seed=seed)))
    for epoch, _ in algorithm.fitter(
        data,
        n_steps=steps,
        n_steps_per_epoch=GRADIENT_STEPS,
        logger_adapter=d3rlpy.logging.NoopAdapterFactory(),
        show_progress=False,
    ):
        if after_update(epoch * GRADIENT_STEPS, algorithm.predict):
            break
    return algorithm


if __name__ == "__main__":
    main(train, 10_000)

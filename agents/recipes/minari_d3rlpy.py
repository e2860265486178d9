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
import minari
import numpy as np

from agents.evaluation.dataset import record_episodes, write_dataset
from agents.evaluation.players import find_player
from agents.recipes.race import AfterUpdate, main

DATASET = "elbow_gym/ppo-elbows2-v0"
GRADIENT_STEPS = 1000
"""Gradient steps between two evaluations."""


def data_set(episodes: int = 40, seed: int = 0, noise: float = 0.1) -> minari.MinariDataset:
    """Data set of the shipped PPO policy from scattered starts; one of the same name is replaced.

    Args:
        episodes: number of episodes.
        seed: seed of the starts and of the noise.
        noise: standard deviation of normal noise on the actions, as a share of the largest.
    """
    if DATASET in minari.list_local_datasets():
        minari.delete_dataset(DATASET)
    player = find_player("ppo", 2, arguments={"start_noise": 0.1})
    return write_dataset(player, DATASET, record_episodes(player, episodes, seed, noise))


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
    data = replay_buffer(data_set(seed=seed))
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

#!/usr/bin/env bash
# Package: d3rlpy 2.8.1 (with minari[hdf5] 0.5.4, gymnasium 1.0.0, torch 2.13.0).
# Expected: `d3rlpy.datasets.get_minari` returns the transitions of the Minari data set: each action beside the
#   observation that it was chosen at.
# Seen: a Minari episode of T steps has T + 1 observations. get_minari strings the observations of all episodes
#   together, and the actions of all, and cuts both at the same places. From the second episode on each action is
#   paired with the observation of the step before, in the third with the one before that, and so on.
# Why it matters: nothing fails and the shapes fit; a policy learned from some hundred episodes has learned from pairs
#   that lie hundreds of steps, so whole episodes, apart.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
  d3rlpy==2.8.1 "minari[hdf5]==0.5.4" pillow gymnasium==1.0.0 torch==2.13.0 numpy
export MINARI_DATASETS_PATH="$folder/datasets"
"$folder/venv/bin/python" - <<'PYTHON'
import gymnasium as gym
import minari
import numpy as np
from d3rlpy.datasets import get_minari
from minari.data_collector import EpisodeBuffer

# Pendulum's spaces; each action's first entry is the number of its step, and so is the observation's it belongs to.
EPISODES, STEPS = 3, 5
episodes = [
    EpisodeBuffer(
        id=k,
        observations=np.tile(np.arange(STEPS + 1, dtype=np.float32)[:, None] / 10.0, (1, 3)),
        actions=np.arange(STEPS, dtype=np.float32)[:, None] / 10.0,
        rewards=np.zeros(STEPS),
        terminations=np.zeros(STEPS, dtype=bool),
        truncations=np.arange(STEPS) == STEPS - 1,
        infos={},
    )
    for k in range(EPISODES)
]
minari.create_dataset_from_buffers("toy/steps-v0", episodes, env=gym.make("Pendulum-v1"))
data, _ = get_minari("toy/steps-v0")
shifts = []
for k, episode in enumerate(data.episodes):
    pairs = np.round(10.0 * np.hstack([episode.observations[:, :1], episode.actions])).astype(int).tolist()
    print(f"episode {k}: (step of the observation, step of the action)", pairs)
    shifts.append([seen - done for seen, done in pairs])
assert shifts[0] == [0, 0, 0, 0, 0]
assert shifts[1] == [5, -1, -1, -1, -1]
assert shifts[2] == [4, 4, -2, -2, -2]
PYTHON

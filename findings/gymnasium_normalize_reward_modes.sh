#!/usr/bin/env bash
# Package: gymnasium 1.4.0.
# Expected: `gymnasium.wrappers.vector.NormalizeReward` divides the same rewards of the same episodes by the same
#   scale, whatever the autoreset mode: the discounted return that it keeps starts anew with each episode.
# Seen: it does in "SameStep". In "NextStep", the default, and in the wrapper for single environments, the return is
#   zeroed by a termination alone, and runs on over truncations: of a task that only truncates the wrapper takes the
#   return of one endless episode. Below, episodes of ten rewards of 1: scales of 2.7 and 20.
# Why it matters: the scale is part of an algorithm's learning rate; with a change of the autoreset mode, or from a
#   single environment to a batch, it changes by as much as the horizon of the discount is longer than an episode.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check gymnasium==1.4.0 numpy
"$folder/venv/bin/python" - <<'PYTHON'
import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import NormalizeReward as Single
from gymnasium.wrappers.vector import NormalizeReward


class Ones(gym.Env):
    """Ten rewards of 1, then truncated."""

    observation_space = gym.spaces.Box(0.0, 9.0, (1,))
    action_space = gym.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        return np.zeros(1, dtype=np.float32), {}

    def step(self, action):
        self.steps += 1
        return np.zeros(1, dtype=np.float32), 1.0, False, self.steps == 10, {}


scales = {}
for mode in AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP:
    env = NormalizeReward(SyncVectorEnv([Ones], autoreset_mode=mode), gamma=0.99)
    env.reset(seed=0)
    for _ in range(1000):
        env.step(np.zeros(1, dtype=np.int64))
    scales[mode.value] = float(np.sqrt(env.return_rms.var))
env = Single(Ones(), gamma=0.99)
env.reset(seed=0)
for _ in range(1000):
    if env.step(0)[3]:
        env.reset()
scales["single"] = float(np.sqrt(env.return_rms.var))
returns = np.cumsum(0.99 ** np.arange(10))
print({name: round(scale, 2) for name, scale in scales.items()}, "by hand:", round(returns.std(), 2))
assert abs(scales["SameStep"] - returns.std()) < 0.05
assert scales["NextStep"] > 5.0 * scales["SameStep"]
assert scales["single"] > 5.0 * scales["SameStep"]
PYTHON

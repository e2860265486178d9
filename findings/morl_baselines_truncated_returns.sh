#!/usr/bin/env bash
# Package: morl-baselines 1.3.0 (with mo-gymnasium 1.3.2, gymnasium 1.4.0, torch 2.13.0).
# Expected: MOPPO's returns of an episode end where it is truncated, with the value of its last observation added; no
#   reward of the next episode is in them.
# Seen: MOPPO keeps `terminated` alone as the end of an episode. Over a truncation its returns run on into the next
#   episode of the same arm. PGMORL, which trains its population with MOPPO, inherits it.
# Why it matters: every MuJoCo task of MO-Gymnasium ends by its time limit when the robot does well, so that its last
#   steps are credited with the next episode's rewards, for each objective.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
  morl-baselines==1.3.0 mo-gymnasium==1.3.2 gymnasium==1.4.0 torch==2.13.0 numpy
"$folder/venv/bin/python" - <<'PYTHON'
import time

import gymnasium as gym
import numpy as np
from mo_gymnasium.wrappers.vector import MOSyncVectorEnv
from morl_baselines.single_policy.ser.mo_ppo import MOPPO, MOPPONet


class TwoSteps(gym.Env):
    """Episodes of two steps, truncated, of which the first alone has rewards: 100 and 10."""

    observation_space = gym.spaces.Box(0.0, 9.0, (1,))
    action_space = gym.spaces.Box(-1.0, 1.0, (1,))
    reward_space = gym.spaces.Box(0.0, 100.0, (2,))
    reward_dim = 2

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        return np.zeros(1, dtype=np.float32), {}

    def step(self, action):
        self.steps += 1
        reward = np.array([100.0, 10.0] if self.steps == 1 else [0.0, 0.0], dtype=np.float32)
        return np.full(1, self.steps, dtype=np.float32), reward, False, self.steps == 2, {}


envs = MOSyncVectorEnv([TwoSteps, TwoSteps])
networks = MOPPONet((1,), (1,), reward_dim=2)
for parameter in networks.critic.parameters():
    parameter.data.zero_()  # All values are zero, so that a return is the sum of the rewards in it.
agent = MOPPO(
    0,
    networks,
    np.array([0.5, 0.5], dtype=np.float32),
    envs,
    steps_per_iteration=4,
    num_minibatches=1,
    learning_rate=0.0,
    gamma=1.0,
    gae_lambda=1.0,
    device="cpu",
)
agent.train(time.time() - 1.0, 1, 1)
returns = agent.returns[:, 0].tolist()
print("steps 1 and 2, reset, step 1 of the next episode:", returns)
# The first episode earns [100, 10], all of it in its first step.
assert returns == [[200.0, 20.0], [100.0, 10.0], [100.0, 10.0], [100.0, 10.0]]
PYTHON

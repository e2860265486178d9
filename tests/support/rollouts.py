"""Seeded rollouts, a planner's among them, and their hashes.

As a module, `python -m tests.support.rollouts`, it prints two of them and how many functions had to be compiled.
"""

import hashlib

import numpy as np

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv
from elbow_gym.kernel.build import kernel
from elbow_gym.kernel.path import path
from elbow_gym.kernel.slots import BLOCK_LANES

SETTINGS = {"circle": {"phase": "random"}, "duration": 0.5}


def actions(seed, num_envs):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (40, num_envs, 10)).astype(np.float32)


def single(seed):
    """Hash of two episodes of one arm."""
    env = ElbowArmEnv(**SETTINGS)
    digest = hashlib.sha256(env.reset(seed=seed)[0].tobytes())
    for action in actions(seed, 1)[:, 0]:
        observation, reward, _, truncated, info = env.step(action)
        digest.update(observation.tobytes() + np.array([reward, info["electrical_energy"]]).tobytes())
        if truncated:
            digest.update(env.reset()[0].tobytes())
    return digest.hexdigest()


def batch(seed, num_envs=20, num_threads=1):
    """Hash of two episodes of a batch."""
    env = ElbowArmVectorEnv(num_envs, autoreset_mode="SameStep", num_threads=num_threads, **SETTINGS)
    digest = hashlib.sha256(env.reset(seed=seed)[0].tobytes())
    for action in actions(seed, num_envs):
        observation, reward, *_, info = env.step(action)
        digest.update(observation.tobytes() + reward.tobytes() + info["electrical_energy"].tobytes())
    return digest.hexdigest()


def compiled():
    """How many of the compiled functions that a rollout calls were not in the cache."""
    entries = [entry for lanes in (1, BLOCK_LANES) for entry in kernel(lanes)]
    return sum(sum(entry.stats.cache_misses.values()) for entry in (*entries, path))


if __name__ == "__main__":
    print(single(0), batch(0), compiled())


def driven(env, planner, steps, seed=None):
    """Actions of a planner in the control periods from a reset on."""
    observation, _ = env.reset(seed=seed)
    actions = []
    for _ in range(steps):
        actions.append(planner.predict(observation)[0])
        observation = env.step(actions[-1])[0]
    return np.array(actions)

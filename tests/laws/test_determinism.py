"""Run as a script, it prints the hashes of a rollout with a single and with a batched environment."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv

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


def elsewhere(cache):
    """The hashes from a fresh process with its own Numba cache and string hashing, and how many files the cache has."""
    surroundings = {key: value for key, value in os.environ.items() if key != "PYTHONHASHSEED"}
    ran = subprocess.run(
        [sys.executable, __file__],
        env={**surroundings, "NUMBA_CACHE_DIR": str(cache)},
        check=True,
        capture_output=True,
        text=True,
    )
    return ran.stdout.split(), sum(path.is_file() for path in cache.rglob("*"))


@pytest.fixture(scope="module")
def processes(tmp_path_factory):
    """Two fresh processes, the first one with an empty cache."""
    cache = tmp_path_factory.mktemp("numba")
    return elsewhere(cache), elsewhere(cache)


def test_fresh_processes_with_any_cache_run_the_same_bits(processes):
    (compiled, _), (cached, _) = processes
    assert compiled == cached == [single(0), batch(0)]


def test_second_process_finds_everything_compiled(processes):
    (_, before), (_, after) = processes
    assert before > 0
    assert after == before


@pytest.mark.parametrize("rollout", [single, batch])
def test_seed_makes_the_rollout(rollout):
    assert rollout(0) == rollout(0)
    assert rollout(0) != rollout(1)


@pytest.mark.parametrize("num_threads", [2, 3, 8])
def test_threads_do_not_change_a_bit(num_threads):
    assert batch(0, num_envs=70, num_threads=num_threads) == batch(0, num_envs=70)


if __name__ == "__main__":
    print(single(0), batch(0))

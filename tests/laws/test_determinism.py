"""A seed makes the rollout: fresh processes, caches and threads change no bit of it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.rollouts import batch, single

ROOT = Path(__file__).parents[2]


def elsewhere(cache):
    """The hashes from a fresh process with its own Numba cache and string hashing, and how many files the cache has."""
    surroundings = {key: value for key, value in os.environ.items() if key != "PYTHONHASHSEED"}
    ran = subprocess.run(
        [sys.executable, "-m", "tests.support.rollouts"],
        cwd=ROOT,
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

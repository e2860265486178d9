"""A seed makes the rollout: fresh processes, caches and threads change no bit of it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.rollouts import batch, single

ROOT = Path(__file__).parents[2]


def elsewhere(**environment):
    """The hashes from a fresh process with its own string hashing, and how many functions it compiled."""
    surroundings = {key: value for key, value in os.environ.items() if key != "PYTHONHASHSEED"}
    run = [sys.executable, "-m", "tests.support.rollouts"]
    ran = subprocess.run(run, cwd=ROOT, env=surroundings | environment, check=True, capture_output=True, text=True)
    *hashes, compiled = ran.stdout.split()
    return hashes, int(compiled)


@pytest.mark.slow
def test_another_process_repeats_the_bits_and_compiles_nothing():
    here = [single(0), batch(0)]
    assert elsewhere() == (here, 0)


@pytest.mark.soak
def test_a_process_with_an_empty_cache_compiles_once_to_the_same_bits(tmp_path):
    here, cache = [single(0), batch(0)], {"NUMBA_CACHE_DIR": str(tmp_path)}
    found, compiled = elsewhere(**cache)
    assert found == here
    assert compiled > 0
    assert elsewhere(**cache) == (here, 0)


@pytest.mark.parametrize("rollout", [single, batch])
def test_seed_makes_the_rollout(rollout):
    assert rollout(0) == rollout(0)
    assert rollout(0) != rollout(1)


@pytest.mark.parametrize("num_threads", [2, 3, 8])
def test_threads_do_not_change_a_bit(num_threads):
    assert batch(0, num_envs=70, num_threads=num_threads) == batch(0, num_envs=70)

"""Jobs on Ray: a cluster that the pool starts, workers that are killed or unwanted, arrays, threads and ids."""

import os
import signal
import time
from functools import partial

import numpy as np
import pytest

pytest.importorskip("ray")

import ray

from agents.jobs.job import Job
from agents.jobs.machines import HERE, Machines
from agents.jobs.pool import KILLED
from tests.support import jobs as work

RAY = Machines(ray=HERE, workers=2, retries=1)


def outcomes_of(pool, jobs, told):
    for key, job in jobs.items():
        pool.submit(key, job)
    return dict(pool.outcomes(told.append))


def stopped(pool, folder):
    """Outcomes of jobs of which all but the last had begun when they were stopped, and whether they had the time."""
    paths = [folder / str(k) for k in range(3)]
    for path in paths:
        pool.submit(path.name, Job(partial(work.wait_until_unwanted, path), 1))
    deadline = time.monotonic() + 120.0
    while not all(path.with_suffix(".begun").exists() for path in paths[:2]):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    pool.stop()
    return dict(pool.outcomes(lambda _: None)), [path.exists() for path in paths]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_local_cluster_does_what_processes_do(tmp_path, capsys):
    handler, told = signal.getsignal(signal.SIGTERM), []
    # One pool for all: each would start a cluster of its own.
    with RAY.pool(1) as pool:
        assert ray.is_initialized()
        assert signal.getsignal(signal.SIGTERM) is handler
        jobs = {
            "dies once": Job(partial(work.die_once, tmp_path / "died"), 4, "once"),
            "fails": Job(work.fail, 1),
            "lives": Job(work.surroundings, 1),
            # Ray shows large arrays in its own memory, where nobody may write.
            "array": Job(partial(work.double, np.ones(100_000)), 1),
            "id": Job(work.made_by_id, 1),
            "elsewhere": Job(partial(work.begin, 1), 1, folder=tmp_path / "not there"),
        }
        found = outcomes_of(pool, jobs, told)
        outcomes, ended = stopped(pool, tmp_path)
    assert not ray.is_initialized()
    assert f"once: {KILLED}; it goes on from what it has stored" in capsys.readouterr().out
    assert isinstance(found["fails"], ValueError)
    assert str(found["fails"]) == "wrong"
    assert found["lives"][0] == ["1", "1", "1"]
    assert found["lives"][2] != os.getpid()
    found["array"] += 1.0
    np.testing.assert_array_equal(found["array"], np.full(100_000, 3.0))
    assert found["id"] == work.made_by_id(None)
    assert str(found["elsewhere"]).startswith("--storage must be a folder that every machine sees, got")
    # Of the one that failed a unit, and all of the one that a second worker has done.
    assert sum(told) == 5
    assert outcomes == {"0": None, "1": None, "2": None}
    assert ended == [True, True, False]


@pytest.mark.soak
@pytest.mark.filterwarnings("ignore")
def test_job_that_kills_each_of_its_workers_is_given_up():
    with RAY.pool(1) as pool:
        found = outcomes_of(pool, {"dies": Job(work.die, 1), "lives": Job(partial(work.begin, 1), 1)}, [])
    assert isinstance(found["dies"], ChildProcessError)
    assert str(found["dies"]).startswith(KILLED)
    assert found["lives"] == 1


@pytest.mark.soak
@pytest.mark.filterwarnings("ignore")
def test_workers_of_a_machine_compile_a_kernel_once(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    with RAY.pool(2) as pool:
        taken = sorted(outcomes_of(pool, {k: Job(work.first_step, 1) for k in range(2)}, []).values())
    assert 2.0 * taken[0] < taken[1]

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


def ends_of(jobs, told):
    with RAY.pool(len(jobs)) as pool:
        for key, job in jobs.items():
            pool.submit(key, job)
        return dict(pool.outcomes(told.append))


def stopped(folder):
    """Outcomes of jobs of which all but the last had begun when they were stopped, and the files that say who had."""
    paths = [folder / str(k) for k in range(3)]
    with RAY.pool(len(paths)) as pool:
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
    # Each pool would start a cluster of its own.
    with RAY.pool(1):
        assert ray.is_initialized()
        assert signal.getsignal(signal.SIGTERM) is handler
        found = ends_of(
            {
                "dies": Job(work.die, 1),
                "dies once": Job(partial(work.die_once, tmp_path / "died"), 4, "once"),
                "fails": Job(work.fail, 1),
                "lives": Job(work.surroundings, 1),
                # Ray shows large arrays in its own memory, where nobody may write.
                "array": Job(partial(work.double, np.ones(100_000)), 1),
                "id": Job(work.made_by_id, 1),
                "elsewhere": Job(partial(work.begin, 1), 1, folder=tmp_path / "not there"),
            },
            told,
        )
        outcomes, ended = stopped(tmp_path)
    assert not ray.is_initialized()
    assert isinstance(found["dies"], ChildProcessError)
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
def test_workers_of_a_machine_compile_a_kernel_once(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    taken = sorted(ends_of({k: Job(work.first_step, 1) for k in range(2)}, []).values())
    assert 2.0 * taken[0] < taken[1]

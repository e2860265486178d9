"""Pools of workers: outcomes and progress, workers that are killed, and jobs that nobody waits for any more."""

import os
import signal
import time
from functools import partial
from multiprocessing.resource_tracker import _resource_tracker

import numpy as np
import pytest

from agents.jobs import machines as module
from agents.jobs.job import Job
from agents.jobs.machines import HERE, Machines, do_all
from agents.jobs.pool import KILLED
from agents.jobs.processes import ENDED, ONE_THREAD, Processes, exit_code
from tests.support import jobs as work
from tests.support.workers import PoolHere, do_jobs_here


def outcomes(pool, jobs, told):
    with pool:
        for key, job in jobs.items():
            pool.submit(key, job)
        return dict(pool.outcomes(told.append))


def test_outcome_is_the_result_or_the_error_or_none_where_the_work_was_stopped():
    told = []
    jobs = {"a": Job(partial(work.begin, 4), 4), "b": Job(work.fail, 4), "c": Job(work.stopped, 4)}
    found = outcomes(PoolHere(), jobs, told)
    assert (found["a"], found["c"]) == (4, None)
    assert isinstance(found["b"], ValueError)
    assert sum(told) == 5


def test_jobs_that_are_submitted_meanwhile_are_done_too():
    with PoolHere() as pool:
        pool.submit(0, Job(partial(work.begin, 1), 1))
        found = []
        for key, _ in pool.outcomes(lambda _: None):
            found.append(key)
            if key < 3:
                pool.submit(key + 1, Job(partial(work.begin, 1), 1))
    assert found == [0, 1, 2, 3]


def test_all_results_come_in_the_order_of_their_jobs_and_the_first_error_is_raised(monkeypatch):
    do_jobs_here(monkeypatch)
    told = []
    jobs = {size: Job(partial(work.begin, size), size) for size in (1, 3, 2)}
    assert list(do_all(jobs, told.append).items()) == [(1, 1), (3, 3), (2, 2)]
    assert told == [3, 2, 1], "the longest comes first, so that no core idles at the end"
    with pytest.raises(ValueError, match="wrong"):
        do_all({0: Job(work.fail, 1)}, told.append)


def test_folders_lie_on_the_storage_unless_they_are_named_in_full(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "find_spec", lambda _: True)
    monkeypatch.chdir(tmp_path)
    runs, full = module.Path("runs"), tmp_path / "elsewhere"
    assert Machines().place(runs) == runs
    # A worker of Ray has a working folder of its own.
    assert Machines(ray=HERE).place(runs) == tmp_path / "runs"
    shared = Machines(storage=tmp_path / "shared")
    assert (shared.place(runs), shared.place(full)) == (tmp_path / "shared" / "runs", full)


def test_machines_that_are_not_there_are_named(monkeypatch):
    with pytest.raises(ValueError, match="workers must be positive, got 0"):
        Machines(workers=0)
    with pytest.raises(ValueError, match="--workers must not be given for the cluster auto, got 2"):
        Machines(ray="auto", workers=2)
    monkeypatch.setattr(module, "find_spec", lambda _: None)
    with pytest.raises(ValueError, match=r'ray must be installed for --ray, got none: pip install -e "\.\[cluster\]"'):
        Machines(ray=HERE)


@pytest.mark.parametrize(("codes", "expected"), [([-9], -9), ([None, None, 3], 3), ([None], None)])
def test_exit_code_that_another_thread_has_taken_is_waited_for(codes, expected):
    class Ended:
        asked = 0

        def join(self):
            pass

        @property
        def exitcode(self):
            self.asked += 1
            return codes[min((self.asked + 1) // 2, len(codes)) - 1]

    assert exit_code(Ended()) == expected


@pytest.mark.slow
def test_killed_workers_take_no_other_job_along_and_their_own_goes_on_elsewhere(tmp_path, monkeypatch, capsys):
    for name in ONE_THREAD[1:]:
        monkeypatch.delenv(name, raising=False)
    before, told = dict(os.environ), []
    jobs = {
        "dies": Job(work.die, 1),
        "dies once": Job(partial(work.die_once, tmp_path / "died"), 4, "once"),
        "leaves": Job(work.leave, 1, "leaver"),
        "lives": Job(work.surroundings, 1),
        "array": Job(partial(work.double, np.ones(3)), 1),
    }
    found = outcomes(Processes(2, retries=1), jobs, told)
    assert isinstance(found["dies"], ChildProcessError)
    assert str(found["dies"]) == KILLED
    said = capsys.readouterr().out
    assert f"once: {KILLED}; it goes on from what it has stored" in said
    assert "leaver" not in said
    assert str(found["leaves"]) == f"{ENDED}, with exit code 3"
    assert sum(told) == 4
    np.testing.assert_array_equal(found["array"], np.full(3, 2.0))
    threads, blocked, process = found["lives"]
    assert threads[1:] == ["1", "1"]
    assert {signal.SIGINT, signal.SIGTERM, signal.SIGHUP} <= set(blocked)
    assert process != os.getpid()
    assert dict(os.environ) == before
    assert not signal.pthread_sigmask(signal.SIG_BLOCK, ())


@pytest.mark.slow
def test_first_worker_of_a_program_hears_no_signals():
    # With its first lock Python starts this process of its own.
    _resource_tracker._stop()
    found = outcomes(Processes(1, retries=0), {0: Job(work.surroundings, 1)}, [])
    assert {signal.SIGINT, signal.SIGTERM, signal.SIGHUP} <= set(found[0][1])


@pytest.mark.slow
def test_jobs_that_are_stopped_end_by_themselves_and_those_that_wait_never_begin(tmp_path):
    paths = [tmp_path / str(k) for k in range(2)]
    with Processes(1, retries=1) as pool:
        for path in paths:
            pool.submit(path, Job(partial(work.wait_until_unwanted, path), 1))
        deadline = time.monotonic() + 60.0
        while not paths[0].with_suffix(".begun").exists():
            assert time.monotonic() < deadline
            time.sleep(0.05)
        pool.stop()
        assert dict(pool.outcomes(lambda _: None)) == {paths[0]: None, paths[1]: None}
    assert [path.exists() for path in paths] == [True, False]
    assert not paths[1].with_suffix(".begun").exists()

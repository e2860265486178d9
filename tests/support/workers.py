"""Jobs for workers, done in this process: starting another costs seconds of imports."""

import pickle
from concurrent.futures import Future

from agents.jobs.job import perform
from agents.jobs.machines import Machines
from agents.jobs.pool import Pool


def in_this_process(jobs, tell, *_):
    """What `agents.jobs.machines.do_all` gives, of jobs that could be sent to processes."""
    return {key: pickle.loads(pickle.dumps(job)).work(tell) for key, job in jobs.items()}


class PoolHere(Pool):
    """A pool that starts no process; what it is given must be picklable."""

    def __init__(self):
        super().__init__()
        self._said = []

    def __exit__(self, *_):
        pass

    def stop(self):
        """Nothing is going on."""

    def _start(self, number, job):
        job = pickle.loads(pickle.dumps(job))
        future = Future()
        try:
            future.set_result(perform(job, lambda done, line: self._said.append((number, done, line))))
        except Exception as error:
            future.set_exception(error)
        return future

    def _messages(self):
        while self._said:
            yield self._said.pop(0)


def do_jobs_here(monkeypatch):
    """Has all machines do their jobs in this process."""
    monkeypatch.setattr(Machines, "pool", lambda *_: PoolHere())

"""Jobs for processes, done in this one: starting a process costs seconds of imports."""

import pickle
from concurrent.futures import Executor, Future


def in_this_process(jobs, tell):
    """What `agents.workers.in_processes` gives, of jobs that could be sent to processes."""
    return {key: pickle.loads(pickle.dumps(job)).work(tell) for key, job in jobs.items()}


class PoolHere(Executor):
    """A ProcessPoolExecutor that starts no process, whatever its arguments; what it is given must be picklable."""

    def __init__(self, *_, **__):
        pass

    def stop(self):
        """Nothing is going on."""

    def submit(self, function, /, *arguments):
        function, arguments = pickle.loads(pickle.dumps((function, arguments)))
        future = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

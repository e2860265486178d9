"""Processes of this machine as a pool of workers, which take a core each and do not outlive their use."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import connection
from typing import Any

from agents.jobs.job import Job, end_soon, perform
from agents.jobs.pool import KILLED, PERIOD, Message, Pool, restarted

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables of the environment that say how many threads a process's linear algebra takes."""
ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals that ask a process to end."""
ENDED = 'a worker process ended by itself (a script needs `if __name__ == "__main__":` around what it does)'
GLANCE = 0.001
"""Time between two questions for the exit code of a process that has ended [s]."""
_STARTING = threading.Lock()
"""Held while a process starts, which inherits what this one's environment has meanwhile."""


class Processes(Pool):
    """Pool of processes, each behind a thread of this one: a process that is killed takes no other's job with it.

    Args:
        workers: number of processes.
        retries: times that a job is given to a new process after the death of its own.
    """

    def __init__(self, workers: int, retries: int) -> None:
        super().__init__()
        self._retries = retries
        # A forked copy of a parent with threads may hang, so workers start afresh.
        self._context = multiprocessing.get_context("spawn")
        self._life, self._end = self._context.Pipe(duplex=False)
        self._threads = ThreadPoolExecutor(workers)
        self._own = threading.local()
        self._executors: list[ProcessPoolExecutor] = []
        # A pipe for each process: one in which all wrote would need a lock, and a killed process would keep it.
        self._pipes: list[Any] = []
        self._notices: list[Message] = []

    def stop(self) -> None:
        """Makes `unwanted` true in the workers; what has not started will not."""
        self._end.close()
        self._threads.shutdown(wait=False, cancel_futures=True)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        """Waits for the workers to end, at most `GRACE` seconds after an error."""
        if kind is not None:
            self.stop()
        self._threads.shutdown(wait=True, cancel_futures=True)
        for executor in self._executors:
            executor.shutdown(wait=True)

    def _start(self, number: int, job: Job[Any]) -> Future[Any]:
        return self._threads.submit(self._await, number, job)

    def _messages(self) -> Iterator[Message]:
        while self._notices:
            yield self._notices.pop(0)
        for pipe in list(self._pipes):
            try:
                while pipe.poll():
                    yield pipe.recv()
            except (EOFError, OSError):
                self._pipes.remove(pipe)

    def _await(self, number: int, job: Job[Any]) -> Any:
        """A job's result, from this thread's process or, where that dies, from further ones."""
        for left in reversed(range(1 + self._retries)):
            with contextlib.suppress(BrokenProcessPool):
                return self._submit(number, job).result()
            self._own.executor, process = None, self._own.process
            if self._end.closed:
                raise InterruptedError("stopped")
            code = exit_code(process)
            if code is not None and code >= 0:
                raise ChildProcessError(f"{ENDED}, with exit code {code}")
            if left:
                self._notices.append((number, 0, restarted(job)))
        raise ChildProcessError(KILLED)

    def _submit(self, number: int, job: Job[Any]) -> Future[Any]:
        if getattr(self._own, "executor", None) is not None:
            return self._own.executor.submit(_do, number, job)
        mine, its = self._context.Pipe(duplex=False)
        # Outside of the block: with its first lock Python starts a process of its own, and lets signals in after that.
        self._own.executor = ProcessPoolExecutor(1, self._context, _meet_parent, (its, self._life))
        with _STARTING, _as_children_start():
            before = multiprocessing.active_children()
            self._executors.append(self._own.executor)
            self._pipes.append(mine)
            future = self._own.executor.submit(_do, number, job)
            [self._own.process] = [one for one in multiprocessing.active_children() if one not in before]
        # The process has its copy: with this one open, its death would not end the pipe.
        its.close()
        return future


def exit_code(process: Any) -> int | None:
    """A process's exit code, waiting for its end; negative, a signal's number, where it was killed.

    Any thread that starts a process looks after the others. Where it does so between this one's wait and its question,
    the code is there a moment later. None, if never: something else has taken it.
    """
    for _ in range(round(PERIOD / GLANCE)):
        process.join()
        if process.exitcode is not None:
            break
        time.sleep(GLANCE)
    return process.exitcode


_pipe: Any = None


def _meet_parent(pipe: Any, life: Any) -> None:
    """Runs once in each worker: keeps the pipe for its progress, and watches over the parent's life.

    Args:
        pipe: for the messages about progress.
        life: end of a pipe whose other end the parent closes to stop its workers, or by its own end.
    """
    global _pipe  # noqa: PLW0603
    _pipe = pipe

    def watch() -> None:
        connection.wait([life])
        end_soon()

    threading.Thread(target=watch, daemon=True).start()


def _do(number: int, job: Job[Any]) -> Any:
    return perform(job, lambda done, line: _pipe.send((number, done, line)))


@contextlib.contextmanager
def _as_children_start() -> Iterator[None]:
    """Blocks the ending signals and sets one thread for processes that start here, which inherit both."""
    missing = [name for name in ONE_THREAD if name not in os.environ]
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING) if hasattr(signal, "pthread_sigmask") else None
    os.environ.update(dict.fromkeys(missing, "1"))
    try:
        yield
    finally:
        for name in missing:
            del os.environ[name]
        if mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)

"""Pool of workers that do jobs side by side, wherever they are: what comes of each, and one stream of progress."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from typing import Any

from agents.jobs.bar import say
from agents.jobs.job import Job

KILLED = "a worker process was killed, perhaps because memory ran out"
PERIOD = 0.1
"""Time between two looks at the workers' messages [s]."""

Message = tuple[int, int, str]
"""Number of a job, the units of work that it has done in all, and a line for the reader or ""."""


class Pool(ABC):
    """Workers, used as a context; a job whose worker dies is given to another, a few times.

    Signals do not reach the workers, the terminal's Ctrl-C included: the parent decides. An error in the `with` block,
    or the parent's end by any signal, makes `unwanted` true in them; `GRACE` seconds later they are ended.
    """

    def __init__(self) -> None:
        self._jobs: dict[Future[Any], tuple[int, Any]] = {}
        self._done: dict[int, int] = {}

    def __enter__(self) -> Pool:
        return self

    @abstractmethod
    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        """Waits for the workers to end, at most `GRACE` seconds after an error."""

    @abstractmethod
    def stop(self) -> None:
        """Makes `unwanted` true in the workers; what has not started will not."""

    @abstractmethod
    def _start(self, number: int, job: Job[Any]) -> Future[Any]:
        """The future of a job, which starts when a worker is free."""

    @abstractmethod
    def _messages(self) -> Iterator[Message]:
        """The workers' messages since the last call."""

    def submit(self, key: Any, job: Job[Any]) -> None:
        """Gives the workers a job, whose outcome comes under the key."""
        number = len(self._done)
        self._done[number] = 0
        self._jobs[self._start(number, job)] = number, key

    def outcomes(self, progress: Callable[[int], Any]) -> Iterator[tuple[Any, Any]]:
        """Key and outcome of each job as it ends: its result, its error, or None where it was stopped before.

        Jobs may be submitted meanwhile.

        Args:
            progress: called with the units of work since its last call. They are negative where a worker has died and
                its job starts from what it has stored.
        """
        while self._jobs:
            wait(self._jobs, timeout=PERIOD, return_when=FIRST_COMPLETED)
            # Not what `wait` returns: to it, a future that was cancelled is never done.
            finished = [future for future in self._jobs if future.done()]
            self._pass_on(progress)
            for future in finished:
                yield self._jobs.pop(future)[1], outcome(future)

    def _pass_on(self, progress: Callable[[int], Any]) -> None:
        for number, done, line in self._messages():
            if done != self._done[number]:
                progress(done - self._done[number])
                self._done[number] = done
            if line:
                say(line)


def outcome(future: Future[Any]) -> Any:
    """What came of a job that has ended: its result, its error, or None where it was stopped before."""
    if future.cancelled():
        return None
    error = future.exception()
    return None if isinstance(error, InterruptedError) else error or future.result()


def restarted(job: Job[Any]) -> str:
    """Line about a job whose worker has died."""
    return f"{job.name or 'a job'}: {KILLED}; it goes on from what it has stored"

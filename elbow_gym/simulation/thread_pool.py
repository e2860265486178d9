"""Arms spread over threads in whole blocks, so that no result depends on how many threads there are."""

from __future__ import annotations

import itertools
import os
import threading
import time
import weakref
from collections.abc import Callable, Iterable
from queue import SimpleQueue
from typing import Any, NamedTuple

import numpy as np


class Answer(NamedTuple):
    """Result of a share."""

    value: int
    error: BaseException | None = None


class Task(NamedTuple):
    """What to do, with what, the range of arms last, and where the answer goes."""

    work: Callable[..., int]
    arguments: tuple[Any, ...]
    answers: SimpleQueue[Answer]


Inbox = SimpleQueue[Task | None]

NOBODY = 0
"""Process that threads which have not been started belong to."""
SETTLING = 1e-4
"""Time between two looks at threads that finish what an error has left [s]."""


class Sharing:
    """Runs a function over ranges of arms, one range per thread.

    The threads are started by the first call and live until `close` or as long as this object: what
    `concurrent.futures` makes anew for every task costs a control step some twenty microseconds. A forked process has
    none of its parent's threads and starts its own.

    Args:
        num_envs: the number of arms.
        lanes: arms in a block, which stays whole.
        num_threads: ranges at most.
    """

    def __init__(self, num_envs: int, lanes: int, num_threads: int) -> None:
        blocks = -(-num_envs // lanes)
        edges = np.linspace(0, blocks, min(num_threads, blocks) + 1).round().astype(int) * lanes
        self._shares = [(int(a), min(int(b), num_envs)) for a, b in itertools.pairwise(edges)]
        self._process = NOBODY
        self._inboxes: list[Inbox] = []
        self._threads: list[threading.Thread] = []

    def _start(self) -> None:
        self._inboxes = [SimpleQueue() for _ in self._shares[1:]]
        self._threads = [
            threading.Thread(target=_serve, args=(inbox,), name="elbow_gym", daemon=True) for inbox in self._inboxes
        ]
        for thread in self._threads:
            thread.start()
        weakref.finalize(self, _dismiss, self._inboxes)
        self._process = os.getpid()

    def close(self) -> None:
        """Ends the threads, each after what it works on. May be called twice; the next `total` starts new ones."""
        if self._process == os.getpid():
            _dismiss(self._inboxes)
            for thread in self._threads:
                thread.join()
        self._process, self._inboxes, self._threads = NOBODY, [], []

    def total(self, work: Callable[..., int], *arguments: Any) -> int:
        """The sum of `work(*arguments, first, end)` over all shares, when every one is done.

        An error of a share, or an interrupt, is raised when no share is worked on any more.
        """
        if len(self._shares) == 1:
            return work(*arguments, *self._shares[0])
        if self._process != os.getpid():
            self._start()
        # New for every call, so that an answer which an interrupt left behind is never taken for a later one's.
        answers: SimpleQueue[Answer] = SimpleQueue()
        try:
            for inbox, share in zip(self._inboxes, self._shares[1:], strict=True):
                inbox.put(Task(work, (*arguments, *share), answers))
            # This thread takes the first share itself: one hand-over less.
            total = work(*arguments, *self._shares[0])
            given = [answers.get() for _ in self._inboxes]
        except BaseException:
            self._settle()
            raise
        for answer in given:
            if answer.error is not None:
                raise answer.error
            total += answer.value
        return total

    def _settle(self) -> None:
        """Waits until the threads have done all that they were given, however much of that an interrupt let through."""
        done: SimpleQueue[Answer] = SimpleQueue()
        for inbox in self._inboxes:
            inbox.put(Task(_nothing, (), done))
        while done.qsize() < len(self._inboxes):
            time.sleep(SETTLING)


def _nothing() -> int:
    return 0


def _serve(inbox: Inbox) -> None:
    while _done(inbox.get()):
        pass


def _done(task: Task | None) -> bool:
    # Its own frame: a thread that waits must not keep alive what it worked on. Errors are raised by who waits for them.
    if task is None:
        return False
    try:
        answer = Answer(task.work(*task.arguments))
    except BaseException as error:
        answer = Answer(0, error)
    task.answers.put(answer)
    return True


def _dismiss(inboxes: Iterable[Inbox]) -> None:
    for inbox in inboxes:
        inbox.put(None)

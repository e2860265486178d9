"""Job that a process or a machine of its own can do, as its worker sees it: its progress, and whether it is wanted."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

GRACE = 7.0
"""Time that a worker has to end by itself once its work is not wanted any more [s]."""
TELL_PERIOD = 0.2
"""Shortest time between two messages of a job about its progress [s]."""

T = TypeVar("T")
Tell = Callable[..., Any]
"""Function called with the units of work done since its last call, and perhaps with a line for the reader."""
Send = Callable[[int, str], Any]
"""Function called with the units of work that a job has done in all, and a line for the reader or ""."""


@dataclass(frozen=True)
class Job(Generic[T]):
    """Work that can be sent to a worker, and done again from its start or from what it has stored."""

    work: Callable[[Tell], T]
    """Picklable function of `Tell`."""
    size: int
    """Units that it will tell in all."""
    name: str = ""
    """Name for the reader."""
    folder: Path | None = None
    """Folder that the work writes to, which every machine must see; None where it only returns something."""


def counted(size: int, tell: Tell) -> Callable[[int, int], None]:
    """A callback with the steps done and in all that tells the units, of `size` in all, since its last call."""
    told = 0

    def progress(done: int, total: int) -> None:
        nonlocal told
        reached = size * done // total
        tell(reached - told)
        told = reached

    return progress


_unwanted = threading.Event()


def unwanted() -> bool:
    """Whether nobody waits any more for the work of this process, a worker: its parent stops, or has ended."""
    return _unwanted.is_set()


def end_soon() -> None:
    """Makes `unwanted` true, and ends this process, a worker, `GRACE` seconds later."""
    _unwanted.set()
    timer = threading.Timer(GRACE, os._exit, (1,))
    timer.daemon = True
    timer.start()


def perform(job: Job[T], send: Send) -> T:
    """Does a job in this process, a worker, and sends how far it has come.

    Raises:
        InterruptedError: the work is `unwanted`.
    """
    _stay_wanted()
    done, sent, last = 0, 0, -TELL_PERIOD

    def tell(units: int, line: str = "") -> None:
        nonlocal done, sent, last
        # Work that ends in good order has more to say.
        if not line:
            _stay_wanted()
        done += units
        now = time.monotonic()
        if line or now - last >= TELL_PERIOD:
            send(done, line)
            sent, last = done, now

    try:
        return job.work(tell)
    finally:
        if done != sent:
            send(done, "")


def _stay_wanted() -> None:
    if unwanted():
        raise InterruptedError("another run failed or was interrupted")

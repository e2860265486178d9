"""Long jobs in processes of their own, side by side, with one stream of progress."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_EXCEPTION, ProcessPoolExecutor, wait
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

T = TypeVar("T")
Tell = Callable[[int], Any]
"""Function called with the units of work done since its last call."""


@dataclass(frozen=True)
class Job(Generic[T]):
    """Work that can be sent to a process: a picklable function of `Tell`, and how many units it will tell in all."""

    work: Callable[[Tell], T]
    size: int


_parent: Any = None


def _meet_parent(ticks: Any, stop: Any) -> None:
    """Runs once in each worker: keeps the pipe for its progress and the event that ends it."""
    global _parent  # noqa: PLW0603
    _parent = ticks, stop


def _do(work: Callable[[Tell], T]) -> T:
    ticks, stop = _parent

    def tell(units: int) -> None:
        if stop.is_set():
            raise InterruptedError("another run failed or was interrupted")
        ticks.put(units)

    return work(tell)


def in_processes(jobs: Mapping[Any, Job[T]], progress: Tell) -> dict[Any, T]:
    """Every job's result under its key, from as many processes as there are cores; a run takes a core to itself.

    The first error ends all jobs and is raised here.
    """
    # A forked copy of a parent with threads may hang, so workers start afresh.
    context = multiprocessing.get_context("spawn")
    ticks, stop = context.SimpleQueue(), context.Event()
    workers = min(os.cpu_count() or 1, len(jobs))
    with ProcessPoolExecutor(workers, context, _meet_parent, (ticks, stop)) as pool:
        # The longest first, so that no core idles at the end.
        longest = sorted(jobs, key=lambda key: -jobs[key].size)
        futures = {key: pool.submit(_do, jobs[key].work) for key in longest}
        unfinished = set(futures.values())
        try:
            while unfinished:
                finished, unfinished = wait(unfinished, timeout=0.1, return_when=FIRST_EXCEPTION)
                for future in finished:
                    future.result()
                while not ticks.empty():
                    progress(ticks.get())
        except BaseException:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        while not ticks.empty():
            progress(ticks.get())
    return {key: future.result() for key, future in futures.items()}

"""Long jobs side by side in processes that end with this one, with one stream of progress; compilation before them."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import connection
from typing import Any, Generic, TextIO, TypeVar

from elbow_gym.task.settings import Settings

BATCH = 16
"""Arms of an environment whose number does not matter, as long as it is no single arm's kernel that steps them."""
PATIENCE = 2.0
"""Time after which a compilation is announced [s]."""
COMPILE_SECONDS = 15
"""Approximate time that one kernel takes to compile [s]."""
WITHOUT_KERNEL: dict[str, Any] = {
    "control_frequency": 50.0,
    "timestep": None,
    "voltage_limit": 24.0,
    "action_unit": "fraction",
    "start": "paper",
    "start_noise": 0.0,
}
"""Arguments of an environment that no kernel depends on, as `compile_before` sets them."""

GRACE = 7.0
"""Time that a worker has to end by itself once its work is not wanted any more [s]."""
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""Variables of the environment that say how many threads a process's linear algebra takes."""
KILLED = "a worker process was killed, perhaps because memory ran out"
ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals that ask a process to end."""

T = TypeVar("T")
Tell = Callable[[int], Any]
"""Function called with the units of work done since its last call."""


class _WithoutNotice:
    """Stream without the kernel's notices that it compiles."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._dropped = stream, False

    def write(self, text: str) -> int:
        """Passes text on, unless it is a notice or the end of its line."""
        drop = text.startswith("elbow_gym: compiling") or (self._dropped and text == "\n")
        self._dropped = drop and text != "\n"
        return len(text) if drop else self._stream.write(text)

    def flush(self) -> None:
        """Flushes the stream behind."""
        self._stream.flush()


def compile_before(
    batches: Iterable[Settings | tuple[Settings, int]], others: Sequence[Callable[[], Any]] = ()
) -> None:
    """Compiles the kernels that environments will need, here and one after the other, before processes start.

    Otherwise each process would compile the same kernel at the same time. Nothing is compiled or said when Numba's
    cache has them; one line on stderr says about how long it takes when it has not.

    Args:
        batches: settings of the environments, each alone or with the number of arms side by side; alone they mean
            a batch. Up to two arms have another kernel than more.
        others: calls that compile further kernels, one each.
    """
    import numpy as np

    from elbow_gym.vector_env import ElbowArmVectorEnv

    wanted: list[tuple[Settings, int]] = []
    for batch in batches:
        settings, arms = (batch, BATCH) if isinstance(batch, Settings) else batch
        alike = replace(settings, **WITHOUT_KERNEL), arms
        if alike not in wanted:
            wanted.append(alike)
    kernels = {(settings.table is False, arms <= 2) for settings, arms in wanted}
    seconds = COMPILE_SECONDS * (len(kernels) + len(others))
    notice = f"Compiling the kernel for this machine, once: about {seconds} s of CPU time."
    said = threading.Event()

    def say() -> None:
        if not said.is_set():
            said.set()
            print(notice, file=stream, flush=True)

    def step_once(settings: Settings, arms: int) -> None:
        env = ElbowArmVectorEnv(arms, **settings.arguments)
        env.reset(seed=0)
        env.step(np.zeros((arms, settings.parsed_arm.n_joints), dtype=np.float32))

    stream = sys.stderr
    with contextlib.redirect_stderr(_WithoutNotice(stream)):
        for work in (*(partial(step_once, *batch) for batch in wanted), *others):
            timer = threading.Timer(PATIENCE, say)
            timer.daemon = True
            timer.start()
            try:
                work()
            finally:
                timer.cancel()


@dataclass(frozen=True)
class Job(Generic[T]):
    """Work that can be sent to a process: a picklable function of `Tell`, and how many units it will tell in all."""

    work: Callable[[Tell], T]
    size: int


def counted(size: int, tell: Tell) -> Callable[[int, int], None]:
    """A callback with the steps done and in all that tells the units, of `size` in all, since its last call."""
    told = 0

    def progress(done: int, total: int) -> None:
        nonlocal told
        reached = size * done // total
        tell(reached - told)
        told = reached

    return progress


def cores() -> int:
    """Number of cores that this process may use, which a job's affinity can make fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


_ticks: Any = None
_unwanted = threading.Event()


def unwanted() -> bool:
    """Whether nobody waits any more for the work of this process, a worker: its parent stops, or has ended."""
    return _unwanted.is_set()


def _meet_parent(ticks: Any, life: Any, bars: Any) -> None:
    """Runs once in each worker: keeps the pipe for its progress, and watches over the parent's life.

    Args:
        ticks: queue for the units of work that are done.
        life: end of a pipe whose other end the parent closes to stop its workers, or by its own end.
        bars: lock of the progress bars.
    """
    from tqdm import tqdm

    global _ticks  # noqa: PLW0603
    _ticks = ticks
    tqdm.set_lock(bars)

    def watch() -> None:
        connection.wait([life])
        _unwanted.set()
        time.sleep(GRACE)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


class Pool(ProcessPoolExecutor):
    """Processes for long work, which take a core each and do not outlive their use.

    Signals do not reach them, the terminal's Ctrl-C included: the parent decides. An error in the `with` block, or the
    parent's end by any signal, makes `unwanted` true in them; `GRACE` seconds later they are ended.

    Args:
        workers: number of processes.
    """

    def __init__(self, workers: int) -> None:
        # A forked copy of a parent with threads may hang, so workers start afresh.
        context = multiprocessing.get_context("spawn")
        self.ticks = context.SimpleQueue()
        life, self._life = context.Pipe(duplex=False)
        super().__init__(workers, context, _meet_parent, (self.ticks, life, context.RLock()))

    def submit(self, function: Callable[..., T], /, *arguments: Any, **named: Any) -> Future[T]:
        """Sends a call to a process, which may be started for it."""
        with _as_children_start():
            return super().submit(_call, function, *arguments, **named)

    def stop(self) -> None:
        """Makes `unwanted` true in the workers; what has not started will not."""
        self._life.close()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        """Waits for the workers to end, at most `GRACE` seconds after an error.

        Raises:
            ChildProcessError: a worker was killed.
        """
        if kind is not None:
            self.stop()
        self.shutdown(wait=True, cancel_futures=True)
        if isinstance(error, BrokenProcessPool):
            raise ChildProcessError(KILLED) from error


def outcome(future: Future[T]) -> T | Exception | None:
    """What came of a call to a `Pool` that has ended: its result, its error, or None where it was stopped before."""
    if future.cancelled() or not future.done():
        return None
    error = future.exception()
    if isinstance(error, InterruptedError):
        return None
    return ChildProcessError(KILLED) if isinstance(error, BrokenProcessPool) else error or future.result()


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


def _call(function: Callable[..., T], *arguments: Any, **named: Any) -> T:
    _stay_wanted()
    return function(*arguments, **named)


def _stay_wanted() -> None:
    if unwanted():
        raise InterruptedError("another run failed or was interrupted")


def _do(work: Callable[[Tell], T]) -> T:
    def tell(units: int) -> None:
        _stay_wanted()
        _ticks.put(units)

    return work(tell)


def in_processes(jobs: Mapping[Any, Job[T]], progress: Tell) -> dict[Any, T]:
    """Every job's result under its key, from as many processes as there are cores; a run takes a core to itself.

    The first error ends all jobs and is raised here.
    """
    with Pool(min(cores(), len(jobs))) as pool:
        # The longest first, so that no core idles at the end.
        longest = sorted(jobs, key=lambda key: -jobs[key].size)
        futures = {key: pool.submit(_do, jobs[key].work) for key in longest}
        unfinished = set(futures.values())
        while unfinished:
            finished, unfinished = wait(unfinished, timeout=0.1, return_when=FIRST_EXCEPTION)
            for future in finished:
                future.result()
            while not pool.ticks.empty():
                progress(pool.ticks.get())
    while not pool.ticks.empty():
        progress(pool.ticks.get())
    return {key: future.result() for key, future in futures.items()}

"""Ray as a pool of workers: the only file that imports it for jobs.

Jobs, results and errors travel as pickles, as they do between processes: arrays arrive as copies of their own, not as
views of Ray's memory that cannot be written to, and what a job is given does not depend on where it is done.
"""

from __future__ import annotations

import os
import pickle
import signal
import time
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

import ray
from ray.exceptions import RayError
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from agents.jobs.job import GRACE, Job, end_soon, perform
from agents.jobs.pool import KILLED, Message, Pool, restarted
from agents.jobs.processes import ONE_THREAD

OBJECTS = 200_000_000
"""Memory of a cluster started here for what jobs return [B]."""


class Board:
    """Actor of Ray that keeps the jobs' messages for the one who has given them, and says when their work is unwanted.

    Workers wait for its answers by `future`: Ray takes a worker in `ray.get` for an idle one and gives its CPU away.
    """

    def __init__(self) -> None:
        import asyncio

        self._messages: list[Message] = []
        self._started: set[int] = set()
        self._over, self._stopped = asyncio.Event(), False

    async def begin(self, number: int) -> tuple[bool, bool]:
        """Whether a job is wanted, and whether it has begun before."""
        again = number in self._started
        self._started.add(number)
        return not self._stopped, again

    async def tell(self, message: Message) -> None:
        """Takes a message."""
        self._messages.append(message)

    async def take_in(self) -> None:
        """Answers once the messages before it are there."""

    async def take(self) -> list[Message]:
        """The messages since the last call."""
        taken, self._messages = self._messages, []
        return taken

    async def end(self, stopped: bool) -> None:
        """Tells the workers that there are no more jobs, or that those they have are unwanted."""
        self._stopped = stopped
        self._over.set()

    async def until_over(self) -> bool:
        """Whether a worker's job is unwanted, once there are no more."""
        await self._over.wait()
        return self._stopped


class Cluster(Pool):
    """Pool of Ray's workers.

    Args:
        address: a cluster's; "local" to start one on this machine, which ends with the pool.
        workers: CPUs of a cluster that is started.
        cpus: CPUs that a job takes.
        retries: times that a job is given to another worker after the death of its own.
    """

    def __init__(self, address: str, workers: int, cpus: int, retries: int) -> None:
        super().__init__()
        self._connected = ExitStack()
        self._connected.enter_context(connection(address, workers))
        # Beside this process, so that no other machine's end takes it along; a call for each worker waits in it.
        here = NodeAffinitySchedulingStrategy(ray.get_runtime_context().get_node_id(), soft=True)
        board = ray.remote(num_cpus=0, max_concurrency=10_000, scheduling_strategy=here)(Board)
        self._board = board.remote()
        self._do = ray.remote(num_cpus=cpus, max_retries=retries)(_do)

    def stop(self) -> None:
        """Makes `unwanted` true in the workers; what has not started will not."""
        self._end(stopped=True)

    def _end(self, stopped: bool) -> None:
        with suppress(RayError):
            ray.get(self._board.end.remote(stopped))

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: Any) -> None:
        """Waits for the workers to end, at most `GRACE` seconds after an error."""
        if kind is not None:
            self.stop()
            deadline = time.monotonic() + GRACE
            while time.monotonic() < deadline and not all(future.done() for future in self._jobs):
                time.sleep(0.1)
        else:
            self._end(stopped=False)
        self._connected.close()

    def _start(self, number: int, job: Job[Any]) -> Future[Any]:
        sent = self._do.remote(self._board, number, pickle.dumps(job)).future()
        found: Future[Any] = Future()
        found.set_running_or_notify_cancel()
        sent.add_done_callback(lambda sent: _unpack(sent, found))
        return found

    def _messages(self) -> Iterator[Message]:
        try:
            yield from ray.get(self._board.take.remote())
        except RayError as error:
            raise ChildProcessError(f"the cluster was lost ({type(error).__name__})") from error


def _unpack(sent: Future[bytes], found: Future[Any]) -> None:
    """Gives a future what Ray has brought."""
    try:
        result, error = pickle.loads(sent.result())
    except RayError as failure:
        result, error = None, ChildProcessError(f"{KILLED} ({type(failure).__name__})")
    except BaseException as failure:
        result, error = None, failure
    if error is None:
        found.set_result(result)
    else:
        found.set_exception(error)


def _do(board: Any, number: int, job: bytes) -> bytes:
    """Does a job in a worker, and returns the pickle of its result and its error."""
    _watch(board)

    def send(done: int, line: str) -> Any:
        return board.tell.remote((number, done, line))

    wanted, again = board.begin.remote(number).future().result()
    try:
        if not wanted:
            raise InterruptedError("another run failed or was interrupted")
        mine = pickle.loads(job)
        if again:
            send(0, restarted(mine))
        if mine.folder is not None and not mine.folder.is_dir():
            raise ValueError(f"--storage must be a folder that every machine sees, got {mine.folder}, not seen by one")
        outcome = perform(mine, send), None
    except Exception as error:
        outcome = None, error
    # A worker's calls arrive in their order: once this one has, all messages are there before the result.
    board.take_in.remote().future().result()
    return pickle.dumps(outcome)


_watched: set[Any] = set()
"""Boards whose end this process, a worker, waits for."""


def _watch(board: Any) -> None:
    """Has this process end where the board says so, or ends itself because those who wait for the jobs have."""
    name = board._actor_id

    def over(answer: Future[bool]) -> None:
        _watched.discard(name)
        if answer.exception() is not None or answer.result():
            end_soon()

    if name not in _watched:
        _watched.add(name)
        board.until_over.remote().future().add_done_callback(over)


@contextmanager
def connection(address: str, workers: int) -> Iterator[None]:
    """Joins a cluster, or starts one, and leaves it; nothing where this process is in one.

    Threads are bounded as in processes, and this process's signals are kept.

    Args:
        address: the cluster's; "local" to start one on this machine, which ends with the block.
        workers: CPUs of a cluster that is started.
    """
    if ray.is_initialized():
        yield
        return
    options: dict[str, Any] = {}
    if address == "local":
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        options = {"num_cpus": workers, "include_dashboard": False, "object_store_memory": OBJECTS}
    with _signals_kept():
        ray.init(
            address,
            **options,
            log_to_driver=False,
            logging_level="error",
            runtime_env={"env_vars": {name: os.environ.get(name, "1") for name in ONE_THREAD}},
        )
    try:
        yield
    finally:
        ray.shutdown()


@contextmanager
def _signals_kept() -> Iterator[None]:
    """Has SIGTERM do afterwards what it did before: Ray makes it end the process at once."""
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        with suppress(ValueError):  # not in the main thread, where Ray leaves it alone
            signal.signal(signal.SIGTERM, before)

"""Machines that do jobs: processes of this one, or Ray's, chosen by the same options in every command."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any, TypeVar

from tyro.constructors import PrimitiveConstructorSpec

from agents.cli import Count, CountOrNone, Seed
from agents.jobs.job import Job
from agents.jobs.pool import Pool

HERE = "local"
"""Ray's address for a cluster that this process starts and ends."""


def _address(words: list[str]) -> str:
    if len(words) > 1:
        raise ValueError(f"must be followed by one address at most, got {' '.join(words)}")
    return words[0] if words else HERE


Address = Annotated[
    str | None,
    PrimitiveConstructorSpec(
        nargs=(0, 1),
        metavar="[ADDRESS]",
        instance_from_str=_address,
        is_instance=lambda value: value is None or isinstance(value, str),
        str_from_instance=lambda value: [] if value is None else [value],
    ),
]
"""Option that names a cluster of Ray; alone it means `HERE`."""

K, T = TypeVar("K"), TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Machines:
    """Where jobs are done. They give the same bits, in the same folders, everywhere.

    Raises:
        ValueError: the number of workers is not positive, or given for a cluster that others have started; or Ray is
            not installed.
    """

    workers: CountOrNone = None
    """Number of processes, one job each; as many as there are cores when None."""
    ray: Address = None
    """Whether jobs go to Ray instead of processes of this command: alone to a cluster that it starts on this machine,
    with an ADDRESS such as "auto" or "head:6379" to that one."""
    cpus: Count = 1
    """Number of CPUs that Ray reserves for a job."""
    retries: Seed = 3
    """Number of times that a job is given to another worker after its own was killed."""
    storage: Path | None = None
    """Folder that all machines share, in which folders that are not named in full lie then."""

    def __post_init__(self) -> None:
        if self.workers is not None and self.workers < 1:
            raise ValueError(f"workers must be positive, got {self.workers}")
        if self.ray is None:
            return
        if self.ray != HERE and self.workers is not None:
            raise ValueError(f"--workers must not be given for the cluster {self.ray}, got {self.workers}")
        if find_spec("ray") is None:
            raise ValueError('ray must be installed for --ray, got none: pip install -e ".[cluster]"')

    def place(self, folder: Path) -> Path:
        """Folder that jobs write to where a command names this one."""
        folder = folder if self.storage is None else self.storage / folder
        # A machine's working folder is its own.
        return folder if self.ray is None else folder.absolute()

    def pool(self, jobs: int) -> Pool:
        """Workers for a number of jobs, as a context."""
        # It knows environments, whose compiler and SciPy no help of a command needs.
        from agents.workers import cores

        workers = self.workers or cores()
        if self.ray is not None:
            from agents.jobs.cluster import Cluster

            return Cluster(self.ray, workers, self.cpus, self.retries)
        from agents.jobs.processes import Processes

        return Processes(max(min(workers, jobs), 1), self.retries)


def do_all(jobs: Mapping[K, Job[T]], progress: Callable[[int], Any], machines: Machines | None = None) -> dict[K, T]:
    """Every job's result under its key, side by side in processes of this machine unless others are given.

    The first error ends all jobs and is raised here.

    Args:
        jobs: the jobs.
        progress: called with the units of work done since its last call.
        machines: where they are done.
    """
    found: dict[K, T] = {}
    with (machines or Machines()).pool(len(jobs)) as pool:
        # The longest first, so that no core idles at the end.
        for key in sorted(jobs, key=lambda key: -jobs[key].size):
            pool.submit(key, jobs[key])
        for key, outcome in pool.outcomes(progress):
            if outcome is None or isinstance(outcome, Exception):
                raise outcome or InterruptedError("a job was stopped")
            found[key] = outcome
    return {key: found[key] for key in jobs}

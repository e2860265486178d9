"""Bounds of many tasks, side by side in processes; solved ones are taken from the store, so that a run can go on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from agents.jobs.job import Job, Tell
from agents.jobs.machines import Machines
from agents.optimal.certificate import Bound
from agents.optimal.search import bound
from agents.optimal.solution import SolveError
from agents.optimal.store import Store
from agents.workers import compile_before
from elbow_gym.task.settings import Settings


def bounds(
    tasks: Sequence[Settings],
    *,
    above_table: bool | None = None,
    fresh: bool = False,
    starts: int = 2,
    workers: int | None = None,
    machines: Machines | None = None,
    progress: Callable[[int, Bound | str], Any] = lambda *_: None,
    store: Store | None = None,
) -> list[Bound | str]:
    """The bound of every task, or why there is none, in the tasks' order.

    Every solved task is in the store at once, and a neighbour for those that start after it. A script needs its
    `if __name__ == "__main__":`.

    Args:
        tasks: arguments of `bound`.
        above_table: as in `bound`.
        fresh: as in `bound`.
        starts: as in `bound`.
        workers: processes, one task each; as many as there are cores when None.
        machines: what solves them in place of `workers`.
        progress: called with a task's number and what is found of it when it is done.
        store: folder of the solved tasks; the checkout's own when None.
    """
    store = Store() if store is None else store
    kernels = {one.elbow_joints: replace(one, circle=None) for one in tasks}
    # The descent and the LQR step a batch, and one arm plays the solution.
    compile_before([pair for one in kernels.values() for pair in ((one, 1), one)])
    found: dict[int, Bound | str] = {}
    store.folder.mkdir(parents=True, exist_ok=True)
    with (machines or Machines(workers=workers)).pool(len(tasks)) as pool:
        for k, one in enumerate(tasks):
            how = {"above_table": above_table, "fresh": fresh, "starts": starts, "store": store}
            pool.submit(k, Job(partial(_bound_apart, one, how), 1, f"task {k}", store.folder))
        for k, answer in pool.outcomes(lambda _: None):
            if isinstance(answer, Exception) and not isinstance(answer, ChildProcessError):
                raise answer
            found[k] = str(answer) if isinstance(answer, ChildProcessError) else answer
            progress(k, found[k])
    return [found[k] for k in range(len(tasks))]


def _bound_apart(settings: Settings, how: Mapping[str, Any], tell: Tell) -> Bound | str:
    """`bound` in a process of its own, with its options; a failure as its reason, which is no error of the others."""
    del tell
    try:
        return bound(settings, **how)
    except (SolveError, ValueError) as error:
        return str(error)

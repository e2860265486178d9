"""Command `python -m agents bound`: the settings that its options mean, and the lines it prints."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from agents.files import check_writable, read_objects, write_csv
from agents.jobs.machines import Machines
from agents.optimal.batch import bounds
from agents.optimal.certificate import Bound
from agents.optimal.search import bound
from agents.optimal.store import Store
from elbow_gym.parameters import as_arm
from elbow_gym.task.settings import Settings

SOLVES = 6
"""Lines of progress of a task from scratch beside one for each start, for the bar."""


def settings_of(
    elbows: Sequence[int], weights: tuple[float, float], pose: Sequence[float] | None, more: Mapping[str, Any]
) -> Settings:
    """`Settings` without start noise.

    Args:
        elbows: one number of elbows up to 2, or joint numbers.
        weights: of the tracking [1/m] and of the energy [1/W].
        pose: start pose [rad], (n,); the arm's nominal pose when None.
        more: further arguments of the environment.
    """
    bearing = int(elbows[0]) if len(elbows) == 1 and elbows[0] <= 2 else tuple(elbows)
    chosen = {"elbows": bearing, "tracking_weight": weights[0], "energy_weight": weights[1], "start_noise": 0.0, **more}
    if pose is not None:
        chosen["arm"] = replace(as_arm(chosen.get("arm", "paper")), nominal_pose=tuple(pose))
    return Settings(**chosen)


def solve_and_print(
    settings: Settings,
    above_table: bool | None,
    fresh: bool,
    output: Path | None,
    starts: int = 2,
    machines: Machines | None = None,
) -> None:
    """Finds a bound with a bar on stderr and prints it.

    Args:
        settings: the task.
        above_table: as in `bound`.
        fresh: as in `bound`.
        output: file for its trajectory, .npz; none when None.
        starts: as in `bound`.
        machines: as in `bound`, and its storage, where it has one, holds the store.
    """
    from tqdm import tqdm

    with tqdm(total=SOLVES + starts, unit="solve", file=sys.stderr) as bar:

        def advance(line: str) -> None:
            bar.set_description(line[:60])
            bar.update()

        store = _store(machines)
        options = {"fresh": fresh, "starts": starts, "machines": machines, "progress": advance, "store": store}
        found = bound(settings, above_table=above_table, **options)
        bar.total = bar.n
    for line in lines(found):
        print(line)
    if output is not None:
        found.optimum.trajectory.save(output)
        print(output)


def solve_file(tasks: Path, output: Path, above_table: bool | None, machines: Machines, starts: int = 2) -> None:
    """Finds the bounds of the tasks of a file with a bar on stderr, and writes a row for each.

    Args:
        tasks: JSON list of objects, the arguments of one environment each.
        output: CSV of the tasks' numbers, what became of them, and the figures.
        above_table: as in `bound`.
        machines: what solves them; their storage, where they have one, holds the store.
        starts: as in `bound`.

    Raises:
        ValueError: the file holds something else, or an environment refuses a task, which is named by its number.
    """
    from tqdm import tqdm

    check_writable(output.parent)
    settings = _settings_in(tasks)
    store = _store(machines)
    with tqdm(total=len(settings), unit="task", file=sys.stderr) as bar:
        found = bounds(
            settings,
            above_table=above_table,
            starts=starts,
            machines=machines,
            progress=lambda *_: bar.update(),
            store=store,
        )
    solved = [one for one in found if isinstance(one, Bound)]
    names = list(solved[0].figures) if solved else []
    rows = [
        [k, "solved", *one.figures.values()] if isinstance(one, Bound) else [k, one, *[""] * len(names)]
        for k, one in enumerate(found)
    ]
    write_csv(output, ["task", "status", *names], rows)
    for k, one in enumerate(found):
        if not isinstance(one, Bound):
            print(f"task {k} failed: {one}")
    print(f"{len(solved)} of {len(found)} tasks solved: {output}")


def _store(machines: Machines | None) -> Store | None:
    """The store on the machines' storage; None for the checkout's own."""
    return None if machines is None or machines.storage is None else Store(machines.place(Path("bounds")))


def _settings_in(tasks: Path) -> list[Settings]:
    settings: list[Settings] = []
    for k, arguments in enumerate(read_objects(tasks)):
        try:
            settings.append(Settings(**{"start_noise": 0.0, **arguments}))
        except (TypeError, ValueError) as error:
            raise ValueError(f"task {k} of {tasks}: {error}") from error
    return settings


def lines(found: Bound) -> list[str]:
    """A bound and its certificate for a reader."""
    optimum, certificate = found.optimum, found.certificate
    return [
        f"return                {-found.cost:.6g} (simulator, under the LQR)",
        f"electrical energy     {optimum.energy:.4g} J",
        f"tracking error        {optimum.error_rms:.3g} mm (root mean square from 2 s on)",
        f"predicted return      {-optimum.predicted_cost:.6g}, {certificate.replay_error:.2g} of it apart",
        f"mesh change           {certificate.mesh_change:.2g} of the cost",
        f"Lagrangian's gradient {certificate.stationarity:.2g}, conditions met to {certificate.violation:.2g}",
        f"complementarity       {certificate.complementarity:.2g}",
        f"smoothing             {1e3 * certificate.smoothing:g} mm",
        f"from                  {optimum.guess}, {found.cpu_seconds:.3g} s of CPU time",
    ]

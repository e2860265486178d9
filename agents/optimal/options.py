"""Options of the commands `python -m agents bound` and `bounds`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from tyro.conf import OmitArgPrefixes, Positional

from agents.cli import Count, JsonObject
from agents.jobs.machines import Machines

NOTHING: dict[str, object] = {}
MACHINES = Machines()


def bound(
    elbows: tuple[int, ...] = (2,),
    circle: JsonObject = NOTHING,
    payload: float = 0.0,
    start: Literal["paper", "on_target"] = "paper",
    pose: tuple[float, ...] | None = None,
    weights: tuple[float, float] = (1.0, 0.001),
    environment: JsonObject = NOTHING,
    under_table: bool | None = None,
    fresh: bool = False,
    starts: Count = 2,
    output: Path | None = None,
    machines: OmitArgPrefixes[Machines] = MACHINES,
) -> None:
    """Finds the best known solution of any task without contact, with its certificate; solved tasks are kept.

    Args:
        elbows: Number of elbows on the table, up to 2, or joint numbers held at z = 0.
        circle: Fields of the circle, or points of a path as its "shape".
        payload: Mass at the hand [kg].
        start: Start pose: "paper" for the arm's nominal one, "on_target" for one whose hand is on the circle.
        pose: Nominal pose of the arm in place of its own [rad].
        weights: Cost per metre of tracking error and per watt of electrical power.
        environment: Other arguments of the environment, such as "arm", "duration" or "voltage_limit".
        under_table: Whether joints may go below z = 0; only with two or more elbows, where they hardly do, when None.
        fresh: Whether it is solved again, and from postures; the better solution is kept.
        starts: Number of postures that a task from scratch is started from.
        output: File for the trajectory, .npz.
        machines: Machines, which follow a start each.
    """
    from agents.optimal.command import settings_of, solve_and_print

    more = {"circle": circle, "payload": payload, "start": start, **environment}
    above_table = None if under_table is None else not under_table
    solve_and_print(settings_of(elbows, weights, pose, more), above_table, fresh, output, starts, machines)


def bounds(
    tasks: Positional[Path],
    output: Positional[Path],
    under_table: bool | None = None,
    starts: Count = 2,
    machines: OmitArgPrefixes[Machines] = MACHINES,
) -> None:
    """Finds the bounds of many tasks side by side and writes a CSV; run it again to go on after an interruption.

    Args:
        tasks: JSON file: a list of objects with the arguments of one environment each.
        output: CSV file: a row for each task.
        under_table: As in `bound`.
        starts: As in `bound`.
        machines: Machines.
    """
    from agents.optimal.command import solve_file

    solve_file(tasks, output, None if under_table is None else not under_table, machines, starts)

"""Kernels for a lane count and a set of switches, compiled when first asked for or taken from the cache."""

import sys
from functools import cache
from threading import Timer
from typing import NamedTuple

import numpy as np

from elbow_gym.kernel import entries
from elbow_gym.kernel.rows import PARAMETER_ROWS, STATE_ROWS, SUMMARY_COLUMNS, SWITCHED_STATE_ROWS
from elbow_gym.kernel.slots import offsets
from elbow_gym.kernel.template import Entry, instances, sources

PATIENCE = 2.0
"""Compilations that take longer [s] are announced."""


class Kernel(NamedTuple):
    """The compiled entries for one lane count and one set of switches."""

    advance: Entry
    accelerations: Entry
    project_poses: Entry


@cache
def kernel(lanes: int, *, table: bool = False, rubbing: bool = False, drive: bool = False) -> Kernel:
    """The entries for blocks of a number of arms; what is off is not compiled.

    With any switch on, state arrays have SWITCHED_STATE_ROWS rows.

    Args:
        lanes: arms in a block, a divisor of `BLOCK_LANES`.
        table: with a compliant table.
        rubbing: with friction on rigid elbows.
        drive: with gear friction, warm windings and a supply that sags.
    """
    letters = "".join(letter for letter, on in zip("trd", (table, rubbing, drive), strict=True) if on)
    known = offsets(lanes, table=table, rubbing=rubbing, drive=drive)
    compiled = instances(known, f"{lanes}{letters}_{sources()}")
    made = Kernel(
        *(compiled[each.__name__] for each in (entries.advance, entries.accelerations, entries.project_poses))
    )
    _compile_now(made, SWITCHED_STATE_ROWS if table or rubbing or drive else STATE_ROWS)
    return made


def _compile_now(made: Kernel, rows: int) -> None:
    """Calls the entries that every run needs once, on an arm of ones; says so when that takes a while."""
    elbows, one = np.array([3]), np.ones((1, 3))
    parameters = np.ones((1, PARAMETER_ROWS, 3))
    state, summary = np.ones((1, rows, 3)), np.zeros((1, SUMMARY_COLUMNS + 1))
    message = "elbow_gym: compiling its kernel for this machine, once; later starts take it from the cache"
    notice = Timer(PATIENCE, print, (message,), {"file": sys.stderr, "flush": True})
    notice.daemon = True
    notice.start()
    try:
        made.advance(state, parameters, one, elbows, 0, 1, 0, 0.001, summary)
        made.project_poses(one, parameters, elbows)
    finally:
        notice.cancel()

"""Kernels for a lane count and a set of switches, compiled when first asked for or taken from the cache."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elbow_gym.kernel import control, entries
from elbow_gym.kernel.slots import offsets
from elbow_gym.kernel.template import Entry, compiled, instances, sources
from elbow_gym.parameters import Array


class Kernel(NamedTuple):
    """The compiled entries for one lane count and one set of switches."""

    control_step: Entry
    accelerations: Entry
    project_poses: Entry

    def advance(
        self,
        state: Array,
        parameters: Array,
        voltage: Array,
        elbows: NDArray[np.int64],
        steps: Array,
        summary: Array,
        first: int,
        end: int,
    ) -> int:
        """Arms first..end-1 through steps of given lengths under constant voltages: a `control_step` without a task.

        Arguments and result are those of `control_step`.
        """
        own = (state, parameters, elbows, steps, summary)
        return self.control_step(voltage, voltage, control.NO_QUEUE, *own, *control.NO_TASK, first, end)

    def observe(
        self, state: Array, summary: Array, clock: NDArray[np.int64], *task: NDArray[Any], first: int, end: int
    ) -> None:
        """Observations and figures of arms first..end-1 as they are: a `control_step` without motion.

        Arguments are those of `control_step`; `task` is all that comes behind the clock.
        """
        still = (control.NO_PARAMETERS, control.NO_ELBOWS, control.NO_STEPS)
        own = (state, *still, summary, clock)
        self.control_step(control.NO_VOLTAGE, control.NO_VOLTAGE, control.NO_QUEUE, *own, *task, first, end)


def kernel(
    lanes: int, *, table: bool = False, rubbing: bool = False, drive: bool = False, exponential: bool = True
) -> Kernel:
    """The entries for blocks of a number of arms, each compiled at its first call; what is off is not compiled.

    With any switch on, state arrays have SWITCHED_STATE_ROWS rows.

    Args:
        lanes: arms in a block, a divisor of `BLOCK_LANES`.
        table: with a compliant table.
        rubbing: with friction on rigid elbows.
        drive: with gear friction, warm windings and a supply that sags.
        exponential: with exact decay of the currents; False takes the classical Runge-Kutta method for all.
    """
    return _made(lanes, table, rubbing, drive, exponential)


@cache
def _made(lanes: int, table: bool, rubbing: bool, drive: bool, exponential: bool) -> Kernel:
    made = assemble(lanes, compiled, table=table, rubbing=rubbing, drive=drive, exponential=exponential)
    # Poses know no switches: the plain kernel's entry does for all, and is compiled once.
    plain = (table, rubbing, drive, exponential) == (False, False, False, True)
    return made if plain else made._replace(project_poses=_made(lanes, False, False, False, True).project_poses)


def assemble(lanes: int, compile_with: Entry, **switches: bool) -> Kernel:
    """A new kernel.

    Args:
        lanes: as for `kernel`, and so are the switches.
        compile_with: `template.compiled`, or a function of its form that leaves the templates plain Python.
    """
    letters = "".join(name[0] for name, on in switches.items() if on)
    made = instances(offsets(lanes, **switches), f"{lanes}{letters}_{sources()}", compile_with)
    return Kernel(
        *(made[entry.__name__] for entry in (control.control_step, entries.accelerations, entries.project_poses))
    )

"""Control periods taken again in finer steps: of arms that leave the representable, or start with energy of their own.

Steps are chosen for what motors make of an arm at rest. A state that a reset is given may hold many times the energy
that a run comes to, and no closed form says how fast the links then whip. So the energy balance of such arms is checked
after every control period, until they have lost that energy, and always that of arms whose currents last so long that
they go on to drive links beyond their motors' free speed. One that keeps no balance in the finest steps ends.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elbow_gym.kernel.build import Kernel
from elbow_gym.kernel.rows import PAID, PARAMETERS, VALID
from elbow_gym.parameters import Array
from elbow_gym.simulation.energy import Account, account, stored
from elbow_gym.simulation.state_views import Readings

FINER = (8, 64)
"""Parts that a step is divided into, one after the other."""
BALANCE = 5e-4
"""Largest share of what is drawn and lost in a control period that may be missing [-]."""
ROUNDING = 1e-12
"""Largest addition of rounding to that, as a share of the energy stored [-]."""
GONE = 10.0
"""Turnover, as a multiple of the energy of its motion at the start, after which an arm moves as its motors make it."""
ALWAYS = 1e300
"""Energy that is never gone [J]."""
LASTING = 0.02
"""Time constant of such currents [s]; the paper's arm has one of 1.5 ms."""
# Rows of the parameters whose product is the decay R / L of the currents.
DECAY = PARAMETERS.index("armature_resistance"), PARAMETERS.index("inverse_inductance")


class Kept(NamedTuple):
    """Arms before a control period, (B, ...) each."""

    state: Array
    summary: Array
    paid: Array
    account: Account


class Retaking(Readings):
    """Part of the simulator that takes control periods again."""

    period: float
    _kernel: Kernel
    _parameters: Array
    _elbow_index: NDArray[np.int64]
    _clock: NDArray[np.int64]
    _motion: Array
    """Energy of each arm's motion at its reset while its balance is checked [J], (B,); else zero."""
    _restless: bool
    """Whether any is checked."""

    @property
    def stored_energy(self) -> Array:
        """Kinetic, potential, elastic and magnetic energy above the least potential energy [J], (B,)."""
        return stored(self._state, self._parameters).total

    def _account(self) -> Account:
        return account(self._state, self._parameters)

    def _watch(self, chosen: NDArray[np.bool_]) -> None:
        """Has the balance checked of those chosen arms that move, or whose currents are `LASTING`."""
        motion = np.zeros(int(chosen.sum()))
        # What has no control periods takes none again.
        if self.period > 0.0 and self._state[chosen, 1:3].any():
            motion = np.nan_to_num(stored(self._state, self._parameters).motion[chosen])
        resistance, inverse = (self._parameters[chosen, row] for row in DECAY)
        lasting = (resistance * inverse).min(axis=1) * LASTING < 1.0
        self._motion[chosen] = np.where(lasting & (self.period > 0.0), ALWAYS, motion)
        self._restless = bool(self._motion.any())

    def _kept(self, task: Array) -> Kept:
        return Kept(self._state.copy(), self._summary.copy(), task[:, PAID].copy(), self._account())

    def _poor(self, kept: Kept | None) -> NDArray[np.bool_]:
        """Arms whose control period is to be taken again, (B,)."""
        if kept is None:
            return ~self.valid
        before, after = kept.account, self._account()
        with np.errstate(invalid="ignore"):
            allowed = BALANCE * (after.turnover - before.turnover) + ROUNDING * before.stored
            unbalanced = ~(np.abs(after.missing - before.missing) <= allowed)
        return ~self.valid | (unbalanced & (self._motion > 0.0))

    def _taken_again(
        self, voltage: Array, steps: Array, task: tuple[NDArray[Any], ...], kept: Kept | None = None
    ) -> int:
        """Takes arms through finer steps that steps made unrepresentable, or that lost or made energy.

        Elbows that for an instant can hardly move against each other need them, and arms that whip. An arm that the
        finest steps do not bring through stays where it was. Returns the number of those, which are not `valid`.
        """
        poor = self._poor(kept)
        for share in FINER:
            if not poor.any():
                break
            finer = np.repeat(steps / share, share)
            for arm in np.flatnonzero(poor):
                self._put_back(arm, task[0], kept)
                one = (int(arm), int(arm) + 1)
                self._kernel.advance(
                    self._state, self._parameters, voltage, self._elbow_index, finer, self._summary, *one
                )
                self._kernel.observe(self._state, self._summary, self._clock, *task, first=one[0], end=one[1])
            poor = self._poor(kept)
        if kept is not None:
            for arm in np.flatnonzero(poor):
                self._put_back(arm, task[0], kept)
                self._summary[arm, VALID] = 0.0
                self._kernel.observe(self._state, self._summary, self._clock, *task, first=int(arm), end=int(arm) + 1)
            self._motion[self._account().turnover > GONE * self._motion] = 0.0
            self._restless = bool(self._motion.any())
        return int((~self.valid).sum())

    def _put_back(self, arm: np.int64, task: Array, kept: Kept | None) -> None:
        if kept is not None:
            self._state[arm], self._summary[arm] = kept.state[arm], kept.summary[arm]
            task[arm, PAID] = kept.paid[arm]

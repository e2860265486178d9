"""Views of a batch of arms by name: read-only, of the running state and of its summary."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elbow_gym.kernel.rows import (
    BELOW_TABLE,
    HAND,
    LOWEST,
    RESIDUAL,
    STATE_ROWS,
    SUMMARY_COLUMNS,
    SWITCHED_STATE,
    VALID,
)
from elbow_gym.parameters import Array


class Readings:
    """The kernel's state and summary arrays under the names and units of their quantities.

    Arrays are (B, n), elbow forces (B, p), positions (B, 3); they are read-only views, true until the next step.
    Contacts are in the order of joints 3..n and, last, the hand; contacts and heat are zero while switched off.
    """

    _state: Array
    _summary: Array

    def _row(self, row: int) -> Array:
        view = self._state[:, row]
        view.flags.writeable = False
        return view

    def _columns(self, first: int, end: int | None) -> Array:
        view = self._summary[:, first:end]
        view.flags.writeable = False
        return view

    @property
    def q(self) -> Array:
        """Relative joint angles [rad], (B, n)."""
        return self._row(0)

    @property
    def q_dot(self) -> Array:
        """Joint rates [rad/s], (B, n)."""
        return self._row(1)

    @property
    def current(self) -> Array:
        """Armature currents [A], (B, n)."""
        return self._row(2)

    @property
    def electrical_energy(self) -> Array:
        """Integral of v i since the reset [J], (B, n); signed, regeneration counts back."""
        return self._row(3)

    @property
    def drawn_energy(self) -> Array:
        """Integral of max(v i, 0) since the reset [J], (B, n)."""
        return self._row(4)

    @property
    def copper_loss(self) -> Array:
        """Integral of R i^2 since the reset [J], (B, n)."""
        return self._row(5)

    @property
    def friction_loss(self) -> Array:
        """Integral of (D + D_m) q_dot^2 since the reset [J], (B, n)."""
        return self._row(6)

    @property
    def link_work(self) -> Array:
        """Integral of tau q_dot since the reset [J], (B, n), tau from eq. 12."""
        return self._row(7)

    @property
    def hand_position(self) -> Array:
        """Hand position [m], (B, 3), in world x, y, z."""
        return self._columns(HAND, HAND + 3)

    @property
    def lowest_height(self) -> Array:
        """Height of the lowest of joints 3..n and the hand [m], (B,)."""
        return self._columns(LOWEST, LOWEST + 1)[:, 0]

    @property
    def below_table(self) -> Array:
        """Time since the reset with a joint or the hand more than 1e-6 m under z = 0 [s], (B,)."""
        return self._columns(BELOW_TABLE, BELOW_TABLE + 1)[:, 0]

    @property
    def valid(self) -> NDArray[np.bool_]:
        """False where the last step left what float64 can represent (the state is then the one before), (B,)."""
        return self._summary[:, VALID] > 0.0

    @property
    def constraint_residual(self) -> Array:
        """Largest vertical acceleration that an elbow has in spite of its force [m/s^2], (B,); zero to rounding.

        It is larger where the elbows' matrix is singular, as when two elbows cannot move against each other; after a
        step that did not resolve such a pose, by the elbow's mean acceleration in it; and after one in which friction
        jammed an elbow, so that no force agreed with Coulomb's law, by the acceleration that the friction was short
        of. Motion and energy are then not to be trusted.
        """
        return self._columns(RESIDUAL, RESIDUAL + 1)[:, 0]

    @property
    def elbow_force(self) -> Array:
        """f_n of the table on each elbow along +z [N], (B, p); negative when the table pulls."""
        return self._columns(SUMMARY_COLUMNS, None)

    def _switched(self, name: str) -> Array:
        if self._state.shape[1] == STATE_ROWS:
            return np.zeros((self._state.shape[0], self._state.shape[2]))
        return self._row(STATE_ROWS + SWITCHED_STATE.index(name))

    @property
    def contact_force(self) -> Array:
        """Forces of the compliant table [N], (B, n - 1, 3): radial, tangential, normal (+z, never negative)."""
        names = ("contact_radial", "contact_tangential", "contact_normal")
        return np.stack([self._switched(name)[:, 1:] for name in names], axis=-1)

    @property
    def contact_loss(self) -> Array:
        """Energy lost in contacts and by rubbing elbows since the reset [J], (B, n - 1)."""
        return self._switched("contact_loss")[:, 1:]

    @property
    def temperature_rise(self) -> Array:
        """Temperature of the windings above the ambient [K], (B, n)."""
        return self._switched("temperature_rise")

    @property
    def supply_loss(self) -> Array:
        """Integral of R_s I^2 inside the supply since the reset [J], (B,)."""
        return self._switched("supply_loss")[:, 0]

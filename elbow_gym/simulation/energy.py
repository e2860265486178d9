"""Energy of a batch of arms: what they store, what they drew and lost, and what is missing of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from elbow_gym.kernel.rows import PARAMETERS, STATE, STATE_ROWS, SWITCHED_STATE
from elbow_gym.parameters import Array


class Stored(NamedTuple):
    """Energy in arms [J], (B,) each."""

    motion: Array
    """Kinetic energy of links, rotors and payload, and that of the inductances."""
    position: Array
    """Potential energy above its least possible value, and elastic energy of a table."""

    @property
    def total(self) -> Array:
        """Sum of both [J], (B,)."""
        return self.motion + self.position


class Account(NamedTuple):
    """Energies since the reset [J], (B,) each."""

    missing: Array
    """Electrical energy less losses and less what is stored: constant where no step loses or makes energy."""
    turnover: Array
    """Drawn energy and losses."""
    stored: Array


@np.errstate(over="ignore", invalid="ignore")
def stored(state: Array, rows: Array) -> Stored:
    """Energy in arms; infinite, or not a number, where float64 cannot represent it.

    Args:
        state: the kernel's state rows, (B, rows, n).
        rows: the kernel's parameter rows, (B, PARAMETER_ROWS, n).
    """
    row = dict(zip(PARAMETERS, np.moveaxis(rows, 1, 0), strict=True))
    q, q_dot, current = state[:, 0], state[:, 1], state[:, 2]
    mass, length, load = row["mass"][:, 1:], row["length"][:, 1:], row["payload"][:, 0]
    phi, omega, psi_dot = np.cumsum(q[:, 1:], 1), np.cumsum(q_dot[:, 1:], 1), q_dot[:, :1]
    sine, cosine = length * np.sin(phi), length * np.cos(phi)
    # Of every link's end and, half of the link before it, its middle.
    rho, z = np.cumsum(sine, 1), np.cumsum(cosine, 1)
    rho_dot, z_dot = np.cumsum(cosine * omega, 1), -np.cumsum(sine * omega, 1)
    middle = (rho - sine / 2.0, rho_dot - cosine * omega / 2.0, z_dot + sine * omega / 2.0)
    axial, difference = row["axial_inertia"][:, 1:], row["inertia_difference"][:, 1:]
    turning = (axial + difference) * omega**2 + (axial + difference * np.sin(phi) ** 2) * psi_dot**2
    moving = mass * (middle[1] ** 2 + middle[2] ** 2 + (middle[0] * psi_dot) ** 2)
    carried = load * (rho_dot[:, -1] ** 2 + z_dot[:, -1] ** 2 + (rho[:, -1] * psi_dot[:, 0]) ** 2)
    rotors = (row["reflected_inertia"] * q_dot**2).sum(1) + row["axial_inertia"][:, 0] * psi_dot[:, 0] ** 2
    magnetic = (current**2 / row["inverse_inductance"]).sum(1)
    lowest = np.cumsum(length, 1)
    raised = (mass * (z - cosine / 2.0 + lowest - length / 2.0)).sum(1) + load * (z[:, -1] + lowest[:, -1])
    elastic = (row["stiffness"][:, 1:] * np.minimum(z, 0.0) ** 2).sum(1)
    motion = ((turning + moving).sum(1) + carried + rotors + magnetic) / 2.0
    return Stored(motion, elastic / 2.0 + row["gravity"][:, 0] * raised)


@np.errstate(over="ignore", invalid="ignore")
def account(state: Array, rows: Array) -> Account:
    """What arms drew, lost and store; arguments are those of `stored`."""
    meter = {name: state[:, STATE.index(name)].sum(1) for name in STATE[3:]}
    lost = meter["copper_loss"] + meter["friction_loss"]
    if state.shape[1] > STATE_ROWS:
        lost = lost + state[:, STATE_ROWS + SWITCHED_STATE.index("contact_loss")].sum(1)
    energy = stored(state, rows).total
    return Account(meter["electrical_energy"] - lost - energy, meter["drawn_energy"] + lost, energy)

"""Places of the collocation program's variables, and its constant parts: derivatives at the points, and the power."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.inverse_dynamics import InverseDynamics
from agents.planning.sparse import Triplets

Array = NDArray[np.float64]

NAMES = ("q", "q_dot", "q_ddot", "current", "elbow_force")
"""Quantities of a point, in their order."""
STATE = ("q", "q_dot", "current")
"""Quantities of a state, in their order."""


@dataclass(frozen=True)
class Layout:
    """Order of the variables: all points one after the other, then the voltages of all periods."""

    periods: int
    degree: int
    """Points in a control period."""
    point_size: int
    """Variables of a point."""
    n: int
    """Joints."""

    @property
    def voltages(self) -> int:
        """First place of the voltages."""
        return self.periods * self.degree * self.point_size

    @property
    def size(self) -> int:
        """Number of variables."""
        return self.voltages + self.periods * self.n

    def voltage(self, period: int) -> Array:
        """Places of a period's voltages, (n,)."""
        return self.voltages + period * self.n + np.arange(self.n)

    def place(self, period: int, point: int, name: str) -> Any:
        """Places of a quantity at point 1..degree of a period; point 0 is the last one before (None at the start)."""
        at = period * self.degree + point - 1
        return None if at < 0 else at * self.point_size + NAMES.index(name) * self.n + np.arange(self.n)


def collocation_rows(layout: Layout, inverse: InverseDynamics, period: float, derivative: Array) -> tuple[Any, Any]:
    """Sparse rows A x = S s of the start state s: derivatives of q, q_dot and current at every point.

    Args:
        layout: order of the variables.
        inverse: motors of the arm.
        period: length of a control period [s].
        derivative: slopes at the points of the polynomials through the start of a period and its points.
    """
    from scipy import sparse

    n, rows, of_start = layout.n, Triplets(), Triplets()
    row = np.arange(n)
    for k in range(layout.periods):
        for j in range(1, layout.degree + 1):
            for number, (name, rate) in enumerate(zip(STATE, ("q_dot", "q_ddot", None), strict=True)):
                scale = inverse.inductance / period if rate is None else np.ones(n)
                for m in range(layout.degree + 1):
                    slope, place = scale * derivative[m, j - 1], layout.place(k, m, name)
                    if place is None:
                        of_start.add(row, number * n + np.arange(n), -slope)
                    else:
                        rows.add(row, place, slope)
                if rate is not None:
                    rows.add(row, layout.place(k, j, rate), np.full(n, -period))
                else:
                    rows.add(row, layout.place(k, j, "current"), inverse.resistance)
                    rows.add(row, layout.place(k, j, "q_dot"), inverse.torque_constant)
                    rows.add(row, layout.voltage(k), -np.ones(n))
                row = row + n
    shapes = (int(row[0]), layout.size), (int(row[0]), len(STATE) * n)
    return sparse.csc_matrix(rows.triplets, shape=shapes[0]), sparse.csr_matrix(of_start.triplets, shape=shapes[1])


def power_form(layout: Layout, inverse: InverseDynamics, period: float) -> tuple[Any, Any]:
    """Sum of the periods' mean powers as x^T P x / 2 + x^T L s of the start state s, P's upper triangle; sparse.

    Under a held voltage the charge is exactly (v h - K_m dq - L di) / R, so the energy is v times that. Arguments of
    `collocation_rows`.
    """
    from scipy import sparse

    entries, of_start = Triplets(), Triplets()
    for k in range(layout.periods):
        v = layout.voltage(k)
        entries.add(v, v, 2.0 / inverse.resistance)
        for name, constant in (("q", inverse.torque_constant), ("current", inverse.inductance)):
            slope = constant / inverse.resistance / period
            entries.add(layout.place(k, layout.degree, name), v, -slope)
            before = layout.place(k, 0, name)
            if before is None:
                of_start.add(v, STATE.index(name) * layout.n + np.arange(layout.n), slope)
            else:
                entries.add(before, v, slope)
    power = sparse.csc_matrix(entries.triplets, shape=(layout.size, layout.size))
    return power, sparse.csr_matrix(of_start.triplets, shape=(layout.size, len(STATE) * layout.n))

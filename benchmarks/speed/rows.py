"""Rows of the speed benchmark, and their ratios to MuJoCo's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.speed.own import ENV_STEP, EULER_STEP, EXPONENTIAL_STEP, RK4_STEP, Contender
from benchmarks.speed.peers import C_LOOP, MUJOCO

RK4_STEPS_PER_ENV_STEP = 10


RATIO = "MuJoCo / this"


@dataclass(frozen=True)
class Row:
    """Times of a contender per unit, in seconds of its clock."""

    contender: Contender
    samples: tuple[float, ...]

    @property
    def quartiles(self) -> tuple[float, float, float]:
        """Lower quartile, median, upper quartile [s]."""
        low, median, high = np.quantile(self.samples, [0.25, 0.5, 0.75])
        return float(low), float(median), float(high)

    @property
    def median(self) -> float:
        """Median [s]."""
        return self.quartiles[1]


def ratios(rows: Sequence[Row]) -> list[float | None]:
    """MuJoCo's time over each row's, for the same unit of the same arm; None where MuJoCo has none.

    Steps are compared with MuJoCo's RK4 step in a C loop (equal cost, not equal accuracy: it has four evaluations, but
    is of first order with motors that have an inductance), evaluations with mj_forward, and an environment step with
    as many of those RK4 steps of 2 ms as make its control period.
    """
    peers = {
        (row.contender.unit, row.contender.joints, row.contender.elbows): row.median
        for row in rows
        if row.contender.family == MUJOCO and row.contender.name in {C_LOOP, "mj_forward"}
    }
    found: list[float | None] = []
    for row in rows:
        unit, times = row.contender.unit, 1
        if unit in {EULER_STEP, EXPONENTIAL_STEP}:
            unit = RK4_STEP
        elif unit == ENV_STEP:
            unit, times = RK4_STEP, RK4_STEPS_PER_ENV_STEP
        peer = peers.get((unit, row.contender.joints, row.contender.elbows))
        found.append(None if peer is None else times * peer / row.median)
    return found

"""Laws of many arms: each is the single arm's, also where voltages are at their limit."""

import numpy as np
import pytest

from agents.control.expansion import MeanPower, riccati
from agents.learning.newton.law import law
from elbow_gym.task.settings import Settings

ARMS, PERIODS, N = 3, 6, 10


@pytest.mark.parametrize("limit", [1e3, 5.0])
def test_laws_of_a_batch_are_those_of_its_arms_one_by_one(limit):
    rng, power = np.random.default_rng(0), MeanPower(Settings())
    slopes = 0.3 * rng.normal(size=(ARMS, PERIODS, 3 * N, 3 * N)), 0.001 * rng.normal(size=(ARMS, PERIODS, 3 * N, N))
    half = rng.normal(size=(ARMS, PERIODS, N, N))
    slope, curvature = rng.normal(size=(ARMS, PERIODS, N)), half @ np.swapaxes(half, -1, -2)
    planned = 0.1 * rng.normal(size=(ARMS, PERIODS + 1, 3 * N)), rng.normal(size=(ARMS, PERIODS, N))
    found = law(slopes, power, (slope, curvature), planned, limit)
    for k in range(ARMS):
        one = [tuple(part[k] for part in parts) for parts in (slopes, planned)]
        steps, gains = riccati(one[0], power, curvature[k], slope[k], one[1], limit)
        assert found.steps[k] == pytest.approx(steps, rel=1e-6, abs=1e-6)
        assert found.gains[k] == pytest.approx(gains, rel=1e-6, abs=1e-6)
    held = np.abs(np.abs(planned[1] + found.steps) - limit) < 1e-6
    assert held.any() == (limit == 5.0)
    assert not found.gains[held].any()

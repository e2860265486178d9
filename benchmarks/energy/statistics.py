"""How many runs become one figure: the interquartile mean and its bootstrap interval."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

CONFIDENCE = 0.95
RESAMPLES = 2000


class Estimate(NamedTuple):
    """An interquartile mean with its 95 % bootstrap interval."""

    value: float
    low: float
    high: float


def interquartile_mean(samples: ArrayLike) -> Estimate:
    """Mean of the middle half of the samples, with a percentile bootstrap interval.

    Samples of several training seeds, (seeds, episodes), count together; a resampling draws seeds first and then
    episodes within each, since episodes of one policy are not independent. The resampling is seeded, so the same
    samples give the same estimate. NaN samples give NaN.
    """
    rows = np.atleast_2d(np.asarray(samples, dtype=np.float64))
    flat = rows.ravel()
    if flat.size == 0:
        raise ValueError("samples must hold at least one value, got none")
    value = float(stats.trim_mean(flat, 0.25))
    if flat.size == 1 or np.ptp(flat) == 0.0 or np.isnan(flat).any():
        return Estimate(value, value, value)
    rng, (seeds, episodes) = np.random.default_rng(0), rows.shape
    chosen = rng.integers(seeds, size=(RESAMPLES, seeds))
    draws = rows[chosen[..., None], rng.integers(episodes, size=(RESAMPLES, seeds, episodes))]
    means = stats.trim_mean(draws.reshape(RESAMPLES, -1), 0.25, axis=1)
    low, high = np.quantile(means, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Estimate(value, float(low), float(high))

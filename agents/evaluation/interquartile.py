"""Many runs as one figure: the interquartile mean or a quantile, and its bootstrap interval."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

CONFIDENCE = 0.95
RESAMPLES = 2000
TRIMMED = 0.25
"""Share of the samples that is left out at either end."""


class Estimate(NamedTuple):
    """A statistic with its 95 % bootstrap interval."""

    value: float
    low: float
    high: float


def center(samples: ArrayLike) -> float:
    """Mean of the middle half of the samples, whatever their shape. ValueError when there is none."""
    flat = np.asarray(samples, dtype=np.float64).ravel()
    if flat.size == 0:
        raise ValueError("samples must hold at least one value, got none")
    return float("nan") if np.isnan(flat).any() else float(_middle(flat).mean())


def interquartile_mean(samples: ArrayLike) -> Estimate:
    """Mean of the middle half of the samples, with the interval of `bootstrapped`."""
    return bootstrapped(samples, lambda drawn: _middle(drawn).mean(axis=-1))


def quantile(samples: ArrayLike, share: float) -> Estimate:
    """Smallest sample that a share of all samples does not exceed, with the interval of `bootstrapped`."""
    return bootstrapped(samples, lambda drawn: np.quantile(drawn, share, axis=-1, method="inverted_cdf"))


def bootstrapped(samples: ArrayLike, statistic: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> Estimate:
    """A statistic with a percentile bootstrap interval.

    Samples of several training seeds, (seeds, episodes), count together; a resampling draws seeds first and then
    episodes within each, since episodes of one policy are not independent. The resampling is seeded, so the same
    samples give the same estimate. NaN samples give NaN.

    Args:
        samples: (episodes,) or (seeds, episodes).
        statistic: maps samples along the last axis, (..., N), to (...).

    Raises:
        ValueError: there are no samples.
    """
    rows = np.atleast_2d(np.asarray(samples, dtype=np.float64))
    flat = rows.ravel()
    if flat.size == 0:
        raise ValueError("samples must hold at least one value, got none")
    if np.isnan(flat).any():
        return Estimate(*[float("nan")] * 3)
    value = float(statistic(flat))
    if flat.size == 1 or np.ptp(flat) == 0.0:
        return Estimate(value, value, value)
    found = statistic(flat[_draws(*rows.shape)])
    low, high = np.quantile(found, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Estimate(value, float(low), float(high))


def _middle(samples: NDArray[np.float64]) -> NDArray[np.float64]:
    """Samples along the last axis without the outer quarters: SciPy's trim_mean without its checks of every call."""
    size = samples.shape[-1]
    lowest = int(TRIMMED * size)
    return np.partition(samples, (lowest, size - lowest - 1), axis=-1)[..., lowest : size - lowest]


@lru_cache(maxsize=8)
def _draws(seeds: int, episodes: int) -> NDArray[np.int64]:
    """Positions in the flat samples of every resampling, (RESAMPLES, seeds * episodes)."""
    rng = np.random.default_rng(0)
    chosen = rng.integers(seeds, size=(RESAMPLES, seeds))
    drawn = rng.integers(episodes, size=(RESAMPLES, seeds, episodes))
    return (chosen[..., None] * episodes + drawn).reshape(RESAMPLES, -1)

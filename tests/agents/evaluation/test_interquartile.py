"""Quantiles and their intervals."""

import numpy as np
import pytest

from agents.evaluation.interquartile import quantile


def test_quantile_is_the_smallest_sample_that_the_share_does_not_exceed():
    samples = np.random.default_rng(0).permutation(np.arange(1.0, 51.0))
    tail, median = quantile(samples, 0.9), quantile(samples, 0.5)
    assert (tail.value, median.value) == (45.0, 25.0)
    assert 38.0 <= tail.low < 45.0 < tail.high <= 50.0
    # The sign test's interval of the median of fifty: the 18th to the 33rd.
    assert (median.low, median.high) == (pytest.approx(18.0, abs=2.0), pytest.approx(33.0, abs=2.0))
    assert quantile([3.0, 3.0], 0.9) == (3.0, 3.0, 3.0)
    with pytest.raises(ValueError, match="samples must hold at least one value, got none"):
        quantile([], 0.5)

"""The reward in plain Python: rounded once as the compiled one, on every version of Python."""

import math

import pytest

from elbow_gym.kernel.reward import fused

TINY = 2.0**-30


def test_product_and_sum_are_rounded_once():
    assert (1.0 + TINY) * (1.0 - TINY) - 1.0 == 0.0
    assert fused(1.0 + TINY, 1.0 - TINY, -1.0) == -(TINY**2)
    assert math.copysign(1.0, fused(-0.0, 1.0, -0.0)) == -1.0


@pytest.mark.parametrize(
    ("a", "b", "c", "expected"),
    [
        (1e300, 1e300, 0.0, math.inf),
        (-math.inf, 2.0, 1.0, -math.inf),
        (math.inf, 0.0, 1.0, math.nan),
        (math.nan, 1.0, 1.0, math.nan),
    ],
)
def test_what_float64_cannot_represent_is_infinite_or_nan_and_never_raises(a, b, c, expected):
    assert fused(a, b, c) == pytest.approx(expected, nan_ok=True)

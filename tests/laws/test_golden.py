"""The simulation of yesterday, to the last bit. If this fails on purpose: make_golden.py, and a CHANGELOG line."""

import numpy as np
import pytest

from tests.make_golden import ELBOWS, GOLDEN, trace


@pytest.mark.parametrize("elbows", ELBOWS)
def test_the_golden_trace_is_repeated_exactly(elbows):
    golden, repeated = np.load(GOLDEN / f"elbows_{elbows}.npz"), trace(elbows)
    assert set(golden) == set(repeated)
    for name in golden:
        np.testing.assert_array_equal(repeated[name], golden[name], err_msg=name)

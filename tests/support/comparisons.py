"""Comparisons to a share of an array's largest entry, and the cases in which rounding lets them hold."""

import numpy as np
from hypothesis import assume

# Where the linear systems are worse conditioned than this, rounding alone exceeds the tolerances.
WORST_CONDITION = 1e7


def assert_close(value, expected, relative):
    """Equal to a share of the expected array's largest entry, or of 1 where that is less."""
    np.testing.assert_allclose(value, expected, rtol=0.0, atol=relative * max(1.0, np.abs(expected).max(initial=0.0)))


def assume_solvable(matrix, jacobian):
    """Leaves out arms whose elbows hardly move, or hardly move against each other."""
    worst = WORST_CONDITION / np.linalg.cond(matrix)
    if len(jacobian) == 0:
        assume(worst > 1.0)
        return
    compliance = jacobian @ np.linalg.solve(matrix, jacobian.T)
    assume((np.diag(compliance) > 1e-6).all() and np.linalg.cond(compliance) < worst)

"""Closed paths as Fourier series of an angle: points and slopes.

Compiled, so that an arm's bits do not depend on how many others there are.
"""

# pyright: basic

from elbow_gym.kernel.sine import sincos
from elbow_gym.kernel.template import common_copy, compiled, compiled_entry

turned = common_copy(sincos, compiled)
"""Sine and cosine of an angle."""


@compiled
def coordinate(coefficients, axis, c, s):
    """A coordinate of a path's point [m] at the angle whose cosine and sine are c and s."""
    value = coefficients[0, axis]
    ch, sh = c, s
    for h in range(1, coefficients.shape[0], 2):
        value += coefficients[h, axis] * ch + coefficients[h + 1, axis] * sh
        ch, sh = ch * c - sh * s, sh * c + ch * s
    return value


@compiled
def slope(coefficients, axis, c, s):
    """Derivative of a coordinate to the angle [m/rad]."""
    value = 0.0
    ch, sh = c, s
    for h in range(1, coefficients.shape[0], 2):
        value += (h + 1) // 2 * (coefficients[h + 1, axis] * ch - coefficients[h, axis] * sh)
        ch, sh = ch * c - sh * s, sh * c + ch * s
    return value


@compiled_entry
def path(coefficients, angle, out):
    """Points out (m, 3) of a closed path at angles (m,): a Fourier series, rows 1, cos, sin, cos 2, sin 2..."""
    for i in range(angle.size):
        s, c = turned(angle[i])
        for axis in range(3):
            out[i, axis] = coordinate(coefficients, axis, c, s)

"""Decay of the currents over a step: e^-z, the phi functions of z = h R / L, and the currents' coefficients."""

# pyright: basic

from elbow_gym.kernel.slots import (
    DECAY, DRIVE, END_0, END_1, END_MID, HALF_DECAY, HALF_GAIN, INVERSE_L, LANES, MEAN_0, MEAN_1, MEAN_DECAY, MEAN_MID,
    RESISTANCE, START_R, STRIDE, TEMPERATURE, U, WARMING,
)  # fmt: skip
from elbow_gym.kernel.template import template

_THIRD, _SIXTH, _FIFTH, _SEVENTH, _NINTH = 1.0 / 3.0, 1.0 / 6.0, 1.0 / 5.0, 1.0 / 7.0, 1.0 / 9.0
_TENTH, _ELEVENTH, _TWELFTH = 1.0 / 10.0, 1.0 / 11.0, 1.0 / 12.0


@template(flat=True)
def exponential(x):
    """e^-x [-] of x >= 0, to 1e-15 absolute: a short series of x / 64, squared six times."""
    y = min(x, 32.0) * (1.0 / 64.0)
    e = 1.0 - y * _SEVENTH * (1.0 - y * 0.125 * (1.0 - y * _NINTH * (1.0 - y * _TENTH)))
    e = 1.0 - y * (1.0 - y * 0.5 * (1.0 - y * _THIRD * (1.0 - y * 0.25 * (1.0 - y * _FIFTH * (1.0 - y * _SIXTH * e)))))
    e *= e
    e *= e
    e *= e
    e *= e
    e *= e
    e *= e
    return e


@template(flat=True)
def phi_4(z):
    """phi_4 [-] by its series, for 0 <= z <= 1/2."""
    f = 1.0 - z * _NINTH * (1.0 - z * _TENTH * (1.0 - z * _ELEVENTH * (1.0 - z * _TWELFTH)))
    return (1.0 - z * _FIFTH * (1.0 - z * _SIXTH * (1.0 - z * _SEVENTH * (1.0 - z * 0.125 * f)))) * (1.0 / 24.0)


@template
def current_coefficients(ws, n, step):
    """Coefficients of the currents over a step of a given length [s], at the windings' present resistance.

    Reads: RESISTANCE, INVERSE_L, TEMPERATURE, WARMING.
    Writes: DECAY, HALF_DECAY, HALF_GAIN, END_0, END_MID, END_1, MEAN_DECAY, MEAN_0, MEAN_MID, MEAN_1, START_R.
    """
    for a in range(n):
        record = U(a * STRIDE)
        for k in range(LANES):
            here = record + k
            resistance = ws[here + RESISTANCE]
            if DRIVE:
                resistance *= 1.0 + ws[here + WARMING] * ws[here + TEMPERATURE]
                ws[here + START_R] = resistance
            gain = step * ws[here + INVERSE_L]
            z = gain * resistance
            half = exponential(0.5 * z)
            decay = half * half
            # Dividing by z loses digits where it is small, the series where it is large.
            near = min(z, 0.5)
            s4 = phi_4(near)
            s3 = _SIXTH - near * s4
            s2 = 0.5 - near * s3
            far = 1.0 / max(z, 0.5)
            f1 = (1.0 - decay) * far
            f2 = (1.0 - f1) * far
            f3 = (0.5 - f2) * far
            f4 = (_SIXTH - f3) * far
            short = z < 0.5
            f1 = 1.0 - near * s2 if short else f1
            f2 = s2 if short else f2
            f3 = s3 if short else f3
            f4 = s4 if short else f4
            ws[here + HALF_DECAY] = half
            ws[here + HALF_GAIN] = gain * f1 / (1.0 + half)
            ws[here + DECAY] = decay
            ws[here + END_0] = gain * (f1 - 3.0 * f2 + 4.0 * f3)
            ws[here + END_MID] = gain * (4.0 * f2 - 8.0 * f3)
            ws[here + END_1] = gain * (4.0 * f3 - f2)
            ws[here + MEAN_DECAY] = f1
            ws[here + MEAN_0] = gain * (f2 - 3.0 * f3 + 4.0 * f4)
            ws[here + MEAN_MID] = gain * (4.0 * f3 - 8.0 * f4)
            ws[here + MEAN_1] = gain * (4.0 * f4 - f3)

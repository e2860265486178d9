"""Sine and cosine without branches or library calls: the same bits for every lane count and processor."""

# pyright: basic

from elbow_gym.kernel.template import template

_ROUND = 6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to the nearest integer
_TWO_OVER_PI = 0.6366197723675814
# pi / 2 in three parts (fdlibm), so that the reduced angle stays exact for any angle an arm can reach.
_PIO2_1, _PIO2_2, _PIO2_3 = 1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


@template(pure=True)
def sincos(x):
    """Sine and cosine [-] of an angle [rad], to 1e-16 absolute for |x| < 1e5: no branch, no library call."""
    turns = (x * _TWO_OVER_PI + _ROUND) - _ROUND
    y = ((x - turns * _PIO2_1) - turns * _PIO2_2) - turns * _PIO2_3
    z = y * y
    zz = z * z
    sine = y + y * z * ((_S1 + z * _S2) + zz * ((_S3 + z * _S4) + zz * (_S5 + z * _S6)))
    cosine = 1.0 - (0.5 * z - zz * ((_C1 + z * _C2) + zz * ((_C3 + z * _C4) + zz * (_C5 + z * _C6))))
    quadrant = turns - 4.0 * ((turns * 0.25 + _ROUND) - _ROUND)  # -2, -1, 0, 1 or 2
    odd = abs(quadrant) == 1.0
    s = cosine if odd else sine
    c = sine if odd else cosine
    s = -s if (quadrant == -1.0 or abs(quadrant) == 2.0) else s
    c = -c if (quadrant == 1.0 or abs(quadrant) == 2.0) else c
    return s, c

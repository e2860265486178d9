"""Reward of a control period: a plain function, which `observe` compiles. No Numba here."""

import math
from fractions import Fraction


def fused(a: float, b: float, c: float) -> float:
    """A b + c, rounded once, as a processor's fused multiply-add gives it."""
    exact = a * b + c
    # A processor gives infinity or NaN here, where `math.fma` raises.
    if not math.isfinite(exact):
        return exact
    if hasattr(math, "fma"):  # from Python 3.13 on
        return math.fma(a, b, c)  # pyright: ignore
    return float(Fraction(a) * Fraction(b) + Fraction(c)) or exact


def reward(error: float, power: float, tracking_weight: float, energy_weight: float) -> tuple[float, float, float]:
    """Both terms of the reward and their sum [-]: -(tracking_weight |hand - target| + energy_weight P).

    Args:
        error: distance of the hand from the target at the end of the control period [m].
        power: mean electrical power over the control period [W].
        tracking_weight: cost per metre [1/m].
        energy_weight: cost per watt [1/W].
    """
    tracking = 0.0 - tracking_weight * error
    return tracking, 0.0 - energy_weight * power, fused(-power, energy_weight, tracking)

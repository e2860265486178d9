"""Steps that resolve an arm's fastest rates: the longest one, and the substeps of a control period."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from elbow_gym.parameters import Array
from elbow_gym.simulation.rates import MECHANISMS, SMOOTH

INTEGRATORS = ("exponential", "rk4")
MOST_SUBSTEPS = 2000
"""Substeps of a control period at most."""
GROWTH = (0.6 / SMOOTH, 1.2 / SMOOTH, 1.8 / SMOOTH)
"""First substeps after the voltage's jump, as shares of the longest that the smooth rates allow."""
CLASSICAL = 0.75
"""Substeps of "rk4", all of them alike after the voltage's jump, as a share of the longest that smooth rates allow."""
FEW = (0.3 / SMOOTH, 0.9 / SMOOTH)
"""Longest control periods that one step and two cover, as such shares."""
# What rounding may add to a step or a count of steps.
HAIR = 1e-9


def limits(found: Mapping[str, float], integrator: str) -> tuple[float, str]:
    """The longest step [s] that resolves every rate, and the name of the one behind it.

    Args:
        found: rates of `rates` [1/s].
        integrator: "exponential" or "rk4".
    """
    steps = _steps(found, integrator)
    name = min(steps, key=steps.__getitem__)
    return steps[name], name


def _steps(found: Mapping[str, float], integrator: str) -> dict[str, float]:
    """Longest step [s] for each rate that the integrator has to resolve."""
    multiples = {name: getattr(mechanism, integrator) for name, mechanism in MECHANISMS.items()}
    return {
        name: multiple / found[name]
        for name, multiple in multiples.items()
        if multiple is not None and found[name] > 0.0
    }


def schedule(period: float, found: Mapping[str, float], integrator: str) -> Array:
    """Substeps of a control period [s], in order; they add up to the period.

    Exponential ones grow, from a short one after the voltage's jump to the longest that resolves every rate, in at most
    four sizes; those of "rk4" are equal, and shorter where motion is free.

    Args:
        period: control period [s].
        found: rates of `rates` [1/s].
        integrator: "exponential" or "rk4".

    Raises ValueError naming the fastest rate when there would be more than `MOST_SUBSTEPS`.
    """
    growing, steps = integrator == "exponential", _steps(found, integrator)
    if not growing:
        steps |= {name: CLASSICAL * step for name, step in steps.items() if MECHANISMS[name].smooth}
    name = min(steps, key=steps.__getitem__)
    longest, smooth = steps[name], min(step for name, step in steps.items() if MECHANISMS[name].smooth)
    first = np.minimum(np.array(GROWTH if growing else ()) * smooth, longest)
    fewest = 1 + sum(growing and period > share * smooth for share in FEW)
    first = first[: max(fewest, np.searchsorted(np.cumsum(first), period * (1.0 - HAIR)) + 1)]
    left = max(0.0, period - float(first.sum()))
    if left > (MOST_SUBSTEPS - first.size) * longest * (1.0 + HAIR):
        raise ValueError(
            f"a control period must take at most {MOST_SUBSTEPS} substeps, got {period:.3g} s in steps of at most "
            f"{longest:.3g} s, for {_cause(found, name)}"
        )
    substeps = np.concatenate([first, np.full(_count(left, longest), longest)])
    return substeps * (period / substeps.sum())


def check_timestep(timestep: float, period: float, found: Mapping[str, float], integrator: str) -> None:
    """Raises ValueError unless a given step resolves every rate and makes at most `MOST_SUBSTEPS` of a period.

    Args:
        timestep: longest step that was asked for [s].
        period: control period [s], which no step exceeds.
        found: rates of `rates` [1/s].
        integrator: "exponential" or "rk4".
    """
    if period / MOST_SUBSTEPS > timestep * (1.0 + HAIR):
        raise ValueError(
            f"timestep must be at least {period / MOST_SUBSTEPS:.3g} s, for at most {MOST_SUBSTEPS} substeps in a "
            f"control period of {period:.3g} s, got {timestep}"
        )
    longest, name = limits(found, integrator)
    if min(timestep, period) > longest * (1.0 + HAIR):
        raise ValueError(f"timestep must be at most {longest:.3g} s, for {_cause(found, name)}, got {timestep}")


def check_option(option: str, step: float, found: Mapping[str, float], integrator: str) -> None:
    """Raises ValueError unless what a reset was given is resolved by the steps of the environment.

    Args:
        option: its name.
        step: longest substep in use [s].
        found: rates of the arm [1/s].
        integrator: "exponential" or "rk4".
    """
    longest, name = limits(found, integrator)
    # A rate beyond float64 is no number, which compares as false.
    if not step <= longest * (1.0 + HAIR):
        raise ValueError(
            f"options[{option!r}] must allow substeps of {step:.3g} s, got {longest:.3g} s at most, for "
            f"{_cause(found, name)}"
        )


def _count(span: float, longest: float) -> int:
    return max(0, math.ceil(span / longest - HAIR))


def _cause(found: Mapping[str, float], name: str) -> str:
    return f"the rate {name!r} of {found[name]:.4g} 1/s ({MECHANISMS[name].constants})"

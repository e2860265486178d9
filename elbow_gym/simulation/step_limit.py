"""Longest step of an arm: its fastest rates in closed form, and the substeps of a control period that resolve them.

A rate [1/s] says how fast something can change. It is resolved while rate times step stays below a multiple, which
depends on the mechanism and the integrator. For every joint let J = k^2 I_m, D the viscous friction of joint and gear,
K = K_m, a = R / L and w = K / sqrt(J L). In M^(1/2) q_dot and L^(1/2) i, arm and motors are damping plus a skew
coupling, and in relative angles the mass matrix is nowhere less than the rotors' J. So for every pose and any elbows

    armature       R / L of the winding where R_th V0^2 / R warms it, and the supply's rate
    supply         R_s times the sum of 1 / L: all currents together make the bus sag
    friction       (D + T_c k / GEAR_SPEED) / J, for Coulomb's friction of the gear comes up over that speed
    coupling       w
    slow coupling  what is left of w where the decay at a is exact: min(w, 2 w^2 / a), as s (s + a) = -w^2
    ringing        sqrt(w^2 - (a + D / J)^2 / 4): a free rotor's oscillation where winding and friction do not damp it
    cooling        1 / (R_th C_th)
    heating        with g = alpha V0^2 / (R C_th), at which a stalled winding warms up: min(sqrt(2 a g), 4 g)
    gravity        sqrt(G l / I) of a link of inertia I about its middle on which the weight G hangs, at most
                   sqrt(sum of G l / J), for each joint the links that it carries
    speed          sum of the pitch joints' free speeds K V0 / (R D + K^2): how fast the hand can turn
    table          sqrt(k / m_e), m_e the mass that a free link opposes to a force on its end, m / 4 where it is thin
    dissipation    c W / m_e under the weight W of arm and payload
    sliding        mu W / (m v_s) of the lightest link, on the table and under rigid elbows
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.kernel.rows import ELBOW_SPEED, GEAR_SPEED, PARAMETERS
from elbow_gym.parameters import Array
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_rows

INTEGRATORS = ("exponential", "rk4")
Ends = Mapping[str, Array]

MOST_SUBSTEPS = 2000
"""Substeps of a control period at most."""
# What rounding may add to a step or a count of steps.
HAIR = 1e-9
SMOOTH, CONTACT, ARMATURE, RINGING, TURN = 2.2, 0.7, 1.4, 1.0, 1.0
GROWTH = (0.6 / SMOOTH, 1.2 / SMOOTH, 1.8 / SMOOTH)
"""First substeps after the voltage's jump, as shares of the longest that the smooth rates allow."""


class Mechanism(NamedTuple):
    """Cause of a rate, and the largest rate times step [-] by integrator; None where the integrator is exact."""

    constants: str
    """Formula of the rate in parameters, for messages."""
    exponential: float | None
    rk4: float | None
    smooth: bool = True
    """Whether it is at work in free motion, which a voltage's jump starts, or only on the table."""


MECHANISMS = {
    "armature": Mechanism("(armature_resistance + supply_resistance) / armature_inductance", None, ARMATURE),
    "supply": Mechanism("supply_resistance / armature_inductance", SMOOTH, None),
    "friction": Mechanism("viscous and Coulomb friction of joint and gear / rotor_inertia", SMOOTH, SMOOTH),
    "coupling": Mechanism("torque_constant / sqrt(rotor_inertia * armature_inductance)", None, SMOOTH),
    "slow coupling": Mechanism("torque_constant^2 / (rotor_inertia * armature_resistance)", SMOOTH, None),
    "ringing": Mechanism("torque_constant / sqrt(rotor_inertia * armature_inductance), undamped", RINGING, RINGING),
    "cooling": Mechanism("1 / (thermal_resistance * heat_capacity)", SMOOTH, SMOOTH),
    "heating": Mechanism("voltage^2 * temperature_coefficient / (armature_resistance * heat_capacity)", SMOOTH, SMOOTH),
    "gravity": Mechanism("sqrt(gravity * mass beyond a link / (its mass * length))", SMOOTH, SMOOTH),
    "speed": Mechanism("voltage / torque_constant, of all pitch joints", TURN, TURN),
    "table": Mechanism("sqrt(stiffness / mass)", CONTACT, CONTACT, smooth=False),
    "dissipation": Mechanism("dissipation * weight / mass", SMOOTH, SMOOTH, smooth=False),
    "sliding": Mechanism("friction * weight / (mass * friction_velocity)", SMOOTH, SMOOTH, smooth=False),
    "rubbing": Mechanism("elbow_friction * weight / mass", SMOOTH, SMOOTH, smooth=False),
}


def rates(
    rows: Array, conditions: Conditions, supply_voltage: ArrayLike | None = None, *, elbows: bool = True
) -> dict[str, float]:
    """The fastest rates [1/s], by the names of `MECHANISMS`; zero where a mechanism is off.

    Over several arms, every quantity of a joint may come from another arm: what any arm between them can have.

    Args:
        rows: parameter rows of `parameter_rows`, (..., PARAMETER_ROWS, n).
        conditions: what the arms work under.
        supply_voltage: V0 of each arm [V], shape (...); the conditions' own when None.
        elbows: whether there are rigid ones.
    """
    every = rows.reshape(-1, *rows.shape[-2:])
    low, high = _by_name(every.min(axis=0)), _by_name(every.max(axis=0))
    volts = float(np.max(conditions.supply_voltage if supply_voltage is None else supply_voltage))
    # What overflows is too fast for any step.
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        found = _motor_rates(low, high, conditions.supply_resistance) | _heat_rates(low, high, volts)
        found |= _link_rates(every, low, high)
        found["speed"] = _free_speed(low, high, volts)
    found["armature"] += found["supply"]
    if conditions.surface is None:
        found |= dict.fromkeys(("table", "dissipation", "sliding"), 0.0)
    if not elbows:
        found["rubbing"] = 0.0
    return {name: math.inf if math.isnan(found[name]) else found[name] for name in MECHANISMS}


def _by_name(rows: Array) -> Ends:
    return {name: rows[index] for index, name in enumerate(PARAMETERS)}


def _motor_rates(low: Ends, high: Ends, supply_resistance: float) -> dict[str, float]:
    inertia, inverse_inductance = low["reflected_inertia"], high["inverse_inductance"]
    friction = high["friction"] + high["reflected_coulomb_friction"] / GEAR_SPEED
    coupling = high["joint_torque_constant"] * np.sqrt(inverse_inductance / inertia)
    decay = low["armature_resistance"] * low["inverse_inductance"] + low["friction"] / high["reflected_inertia"]
    through = 2.0 * high["joint_torque_constant"] ** 2 / (low["armature_resistance"] * inertia)
    return {
        "supply": supply_resistance * float(inverse_inductance.sum()),
        "friction": float((friction / inertia).max()),
        "coupling": float(coupling.max()),
        "slow coupling": float(np.minimum(coupling, through).max()),
        "ringing": math.sqrt(max(0.0, float((coupling**2 - decay**2 / 4.0).max()))),
    }


def _heat_rates(low: Ends, high: Ends, volts: float) -> dict[str, float]:
    resistance, inverse_inductance = high["armature_resistance"], high["inverse_inductance"]
    growth = high["temperature_coefficient"] * high["heating"] * volts**2
    fed_back = np.sqrt(2.0 * inverse_inductance * growth)
    # At rest under V0 the rise T settles where R (1 + alpha T) T = R_th V0^2.
    over_cooling = np.divide(growth, low["cooling"], out=np.zeros_like(growth), where=low["cooling"] > 0.0)
    warmest = (1.0 + np.sqrt(1.0 + 4.0 * over_cooling / resistance)) / 2.0
    return {
        "armature": float((resistance * warmest * inverse_inductance).max()),
        "cooling": float(high["cooling"].max()),
        "heating": float(np.minimum(fed_back, 4.0 * growth / low["armature_resistance"]).max()),
    }


def _free_speed(low: Ends, high: Ends, volts: float) -> float:
    # K V0 / (R D + K^2) is largest at K = sqrt(R D), or at the end of K's range that is nearest to it.
    braking = low["armature_resistance"] * low["friction"]
    constant = np.clip(np.sqrt(braking), low["joint_torque_constant"], high["joint_torque_constant"])
    return volts * float((1.0 / (braking / constant + constant))[1:].sum())


def _link_rates(every: Array, low: Ends, high: Ends) -> dict[str, float]:
    length, mass, end_inertia = (every[:, PARAMETERS.index(name), 1:] for name in ("length", "mass", "end_inertia"))
    middle_inertia = end_inertia - mass * length**2 / 4.0
    beyond = np.cumsum(high["mass"][:0:-1])[::-1] - high["mass"][1:] / 2.0 + high["payload"][1:]
    hanging = high["gravity"][1:] * beyond
    lever = (mass * length / middle_inertia).max(axis=0) / low["mass"][1:]
    carried = np.cumsum((hanging * length.max(axis=0))[::-1])[::-1]
    gravity = min(float((hanging * lever).max()), float((carried / low["reflected_inertia"][1:]).sum()))
    end_mass = low["mass"][1:] / (1.0 + mass * length**2 / (4.0 * middle_inertia)).max(axis=0)
    end_mass[-1] += low["payload"][-1]
    lightest = float(end_mass.min())
    weight = float(high["gravity"][0] * (high["mass"].sum() + high["payload"][0]))
    sliding = weight / float(low["mass"][1:].min())
    return {
        "gravity": math.sqrt(gravity),
        "table": math.sqrt(float(high["stiffness"][0]) / lightest),
        "dissipation": float(high["dissipation"][0]) * weight / lightest,
        "sliding": float((high["table_friction"] / low["friction_velocity"])[0]) * sliding,
        "rubbing": float(high["elbow_friction"][0]) * sliding / ELBOW_SPEED,
    }


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
    four sizes; those of "rk4" are equal.

    Args:
        period: control period [s].
        found: rates of `rates` [1/s].
        integrator: "exponential" or "rk4".

    Raises ValueError naming the fastest rate when there would be more than `MOST_SUBSTEPS`.
    """
    steps = _steps(found, integrator)
    longest, name = limits(found, integrator)
    if integrator == "exponential":
        smooth = min(step for name, step in steps.items() if MECHANISMS[name].smooth)
        first = np.minimum(np.array(GROWTH) * smooth, longest)
    else:
        first = np.zeros(0)
    first = first[: np.searchsorted(np.cumsum(first), period * (1.0 - HAIR)) + 1]
    left = max(0.0, period - float(first.sum()))
    if left > MOST_SUBSTEPS * longest:
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


def check_parameters(step: float, found: Mapping[str, float], integrator: str) -> None:
    """Raises ValueError unless one arm's own parameters are resolved by the steps of the environment.

    Args:
        step: longest substep in use [s].
        found: rates of the arm [1/s].
        integrator: "exponential" or "rk4".
    """
    longest, name = limits(found, integrator)
    if step > longest * (1.0 + HAIR):
        raise ValueError(
            f"options['parameters'] must allow substeps of {step:.3g} s, got {longest:.3g} s at most, for "
            f"{_cause(found, name)}"
        )


def worst_rows(
    values: Mapping[str, Array],
    gravity: float,
    conditions: Conditions,
    ranges: Mapping[str, float | tuple[float, float]],
) -> tuple[Array, float]:
    """Arms at the ends of what may be drawn: parameter rows, (2, PARAMETER_ROWS, n), and the highest V0 [V].

    Their `rates` are at least those of every arm drawn.

    Args:
        values: entries of `quantities`, each (n,), of the nominal arm.
        gravity: g [m/s^2].
        conditions: what the arms work under, nominal in payload and supply voltage.
        ranges: numbers or (low, high), `payload` in kg, factors on `supply_voltage` and on `values`; others are left.
    """
    spans = {name: span if isinstance(span, tuple) else (span, span) for name, span in ranges.items()}
    factor = {name: np.array(spans.get(name, (1.0, 1.0)))[:, None] for name in values}
    ends = {name: value * factor[name] for name, value in values.items()}
    payload = np.array(spans.get("payload", (conditions.payload,) * 2))
    volts = conditions.supply_voltage * np.array(spans.get("supply_voltage", (1.0, 1.0)))
    return parameter_rows(ends, gravity, conditions, payload, volts), float(volts.max())


def _count(span: float, longest: float) -> int:
    return max(0, math.ceil(span / longest - HAIR))


def _cause(found: Mapping[str, float], name: str) -> str:
    return f"the rate {name!r} of {found[name]:.4g} 1/s ({MECHANISMS[name].constants})"

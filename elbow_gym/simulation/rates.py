"""Fastest rates of an arm in closed form, and the multiples of them that a step may take.

A rate [1/s] says how fast something can change. It is resolved while rate times step stays below a multiple, which
depends on the mechanism and the integrator. For every joint let J = k^2 I_m, D the viscous friction of joint and gear,
K = K_m, a = R / L and w = K / sqrt(J L). In M^(1/2) q_dot and L^(1/2) i, arm and motors are damping plus a skew
coupling, and in relative angles the mass matrix is nowhere less than the rotors' J. So for every pose and any elbows

    armature       R / L of the winding where R_th V0^2 / R warms it, for no longer than the arm runs, and the supply's
                   rate
    supply         R_s times the sum of 1 / L: all currents together make the bus sag
    friction       (D + T_c k / GEAR_SPEED) / J, for Coulomb's friction of the gear comes up over that speed
    coupling       w
    slow coupling  c = min(w, 2 w^2 / a), what is left of w where the decay at a is exact, as s (s + a) = -w^2; up to
                   2 c - D / J where friction does not help to damp it
    ringing        sqrt(w^2 - (a + D / J)^2 / 4): a free rotor's oscillation where winding and friction do not damp it
    cooling        1 / (R_th C_th)
    heating        with g = alpha V0^2 / (R C_th), at which a stalled winding warms up: min(sqrt(2 a g), 4 g)
    gravity        sqrt(G l / I) of a link of inertia I about its middle on which the weight G hangs, at most
                   sqrt(sum of G l / J), for each joint the links that it carries
    speed          sum of the pitch joints' free speeds K V0 / (R D + K^2), or of what stalled motors speed up to in
                   an hour where that is less: how fast the hand can turn
    whirl          gravity's rate, with the centripetal acceleration s^2 l of the fastest joint's free speed s for g
    table          sqrt(k / m_e) with m_e the mass that a free link opposes to a force on its end, m / 4 where it is
                   thin
    dissipation    sqrt(2 c v) times the table's, for an impact at v = s l + sqrt(g l); at least c W / m_e, with W the
                   weight of arm and payload
    sliding        mu F / (m v_s) of the lightest link, under the weight W or a fifth of the force K V0 / (R l) with
                   which a stalled motor presses the end of its link, where that is more
    rubbing        the same of rigid elbows, with ELBOW_SPEED for v_s

A state to start from counts with its temperatures, and with its speeds and currents beyond what a run comes to: links
that whip turn OVERSHOOT times as fast as a free motor, and a reversal at full speed draws 2 V0 / R.
Multiples are where the energy balance of motors under voltages that jump between +V0 and -V0 is right to 1e-3, and to
3e-3 with "rk4", whose steps are shorter unless one is given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.kernel.rows import ELBOW_SPEED, GEAR_SPEED, PARAMETERS
from elbow_gym.parameters import Array, cylinder_transverse_inertia
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_rows

Ends = Mapping[str, Array]

# Share of a motor's force on the end of its link that counts for friction.
PRESSING = 0.2
# Time in which motors of next to no torque constant come to no speed [s].
HOUR = 3600.0
# A joint's speed in a run over its motor's free speed, at most as a rule.
OVERSHOOT = 3.0
SMOOTH, CONTACT, ARMATURE, RINGING, GRAVITY, TURN, WHIRL = 2.2, 0.7, 1.4, 0.62, 0.5, 1.0, 2.0


class Mechanism(NamedTuple):
    """Cause of a rate, and the largest rate times step [-] by integrator; None where the integrator is exact."""

    constants: str
    """Formula of the rate in parameters, for messages."""
    exponential: float | None
    rk4: float | None
    smooth: bool = True
    """Whether it is at work in free motion, which a voltage's jump starts, or only on the table."""


class Start(NamedTuple):
    """States that arms are put in, (B, n) each."""

    q_dot: Array
    """Rates [rad/s]."""
    current: Array
    """Armature currents [A]."""
    temperature_rise: Array
    """Of the windings above the ambient [K]."""


MECHANISMS = {
    "armature": Mechanism("(armature_resistance + supply_resistance) / armature_inductance", None, ARMATURE),
    "supply": Mechanism("supply_resistance / armature_inductance", SMOOTH, None),
    "friction": Mechanism("viscous and Coulomb friction of joint and gear / rotor_inertia", SMOOTH, SMOOTH),
    "coupling": Mechanism("torque_constant / sqrt(rotor_inertia * armature_inductance)", None, SMOOTH),
    "slow coupling": Mechanism("torque_constant^2 / (rotor_inertia * armature_resistance)", SMOOTH, None),
    "ringing": Mechanism("torque_constant / sqrt(rotor_inertia * armature_inductance), undamped", RINGING, RINGING),
    "cooling": Mechanism("1 / (thermal_resistance * heat_capacity)", SMOOTH, SMOOTH),
    "heating": Mechanism("voltage^2 * temperature_coefficient / (armature_resistance * heat_capacity)", SMOOTH, SMOOTH),
    "gravity": Mechanism("sqrt(gravity * mass beyond a link / (its mass * length))", GRAVITY, GRAVITY),
    "speed": Mechanism("voltage / torque_constant, of all pitch joints", TURN, TURN),
    "whirl": Mechanism("voltage / torque_constant * sqrt(mass beyond a link / its mass)", WHIRL, WHIRL),
    "table": Mechanism("sqrt(stiffness / mass)", CONTACT, CONTACT, smooth=False),
    "dissipation": Mechanism("sqrt(dissipation * stiffness * speed / mass)", SMOOTH, SMOOTH, smooth=False),
    "sliding": Mechanism("friction * weight / (mass * friction_velocity)", SMOOTH, SMOOTH, smooth=False),
    "rubbing": Mechanism("elbow_friction * weight / mass", SMOOTH, SMOOTH, smooth=False),
}


def rates(
    rows: Array,
    conditions: Conditions,
    supply_voltage: ArrayLike | None = None,
    *,
    elbows: bool = True,
    start: Start | None = None,
    duration: float = math.inf,
) -> dict[str, float]:
    """The fastest rates [1/s], by the names of `MECHANISMS`; zero where a mechanism is off.

    Over several arms, every quantity of a joint may come from another arm: what any arm between them can have.

    Args:
        rows: parameter rows of `parameter_rows`, (..., PARAMETER_ROWS, n).
        conditions: what the arms work under.
        supply_voltage: V0 of each arm [V], shape (...); the conditions' own when None.
        elbows: whether there are rigid ones.
        start: the states that the arms are put in; at rest and cold when None.
        duration: time that the arms run [s].
    """
    every = rows.reshape(-1, *rows.shape[-2:])
    low, high = _by_name(every.min(axis=0)), _by_name(every.max(axis=0))
    volts = float(np.max(conditions.supply_voltage if supply_voltage is None else supply_voltage))
    n = rows.shape[-1]
    given, rise = (np.zeros(n), np.zeros(n)) if start is None else _fastest_and_warmest(start, low, high, volts)
    # What overflows is too fast for any step.
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        found = _motor_rates(low, high, conditions.supply_resistance) | _heat_rates(low, high, volts, rise, duration)
        speed = np.maximum(_free_speeds(low, high, volts), given)
        found |= _motion_rates(every, low, high, speed) | _contact_rates(every, low, high, speed, volts)
    found["armature"] += found["supply"]
    if conditions.surface is None:
        found |= dict.fromkeys(("table", "dissipation", "sliding"), 0.0)
    if not elbows:
        found["rubbing"] = 0.0
    return {name: math.inf if math.isnan(found[name]) else found[name] for name in MECHANISMS}


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


def _by_name(rows: Array) -> Ends:
    return {name: rows[index] for index, name in enumerate(PARAMETERS)}


def _motor_rates(low: Ends, high: Ends, supply_resistance: float) -> dict[str, float]:
    inertia, inverse_inductance = low["reflected_inertia"], high["inverse_inductance"]
    friction = high["friction"] + high["reflected_coulomb_friction"] / GEAR_SPEED
    coupling = high["joint_torque_constant"] * np.sqrt(inverse_inductance / inertia)
    damping = low["friction"] / high["reflected_inertia"]
    decay = low["armature_resistance"] * low["inverse_inductance"] + damping
    slow = np.minimum(coupling, 2.0 * high["joint_torque_constant"] ** 2 / (low["armature_resistance"] * inertia))
    return {
        "supply": supply_resistance * float(inverse_inductance.sum()),
        "friction": float((friction / inertia).max()),
        "coupling": float(coupling.max()),
        "slow coupling": float((2.0 * slow - np.minimum(slow, damping)).max()),
        "ringing": math.sqrt(max(0.0, float((coupling**2 - decay**2 / 4.0).max()))),
    }


def _fastest_and_warmest(start: Start, low: Ends, high: Ends, volts: float) -> tuple[Array, Array]:
    """Free speeds [rad/s] that the start is worth, and its temperature rises [K], (n,) each."""
    beyond = np.maximum(0.0, np.abs(start.current).max(axis=0) - 2.0 * volts / low["armature_resistance"])
    # An inductance can give its energy to the rotor, or to the winding as heat.
    stored = beyond**2 / low["inverse_inductance"]
    speed = np.abs(start.q_dot).max(axis=0) + np.sqrt(stored / low["reflected_inertia"])
    return speed / OVERSHOOT, start.temperature_rise.max(axis=0) + high["heating"] * stored / 2.0


def _heat_rates(low: Ends, high: Ends, volts: float, rise: Array, duration: float) -> dict[str, float]:
    resistance, inverse_inductance = high["armature_resistance"], high["inverse_inductance"]
    growth = high["temperature_coefficient"] * high["heating"] * volts**2
    fed_back = np.sqrt(2.0 * inverse_inductance * growth)
    # At rest under V0 the rise T settles where R (1 + alpha T) T = R_th V0^2, and comes to (1 + alpha T)^2 =
    # (1 + alpha T_0)^2 + 2 growth t / R after a time t in which nothing cools.
    over_cooling = np.divide(growth, low["cooling"], out=np.zeros_like(growth), where=low["cooling"] > 0.0)
    settled = (1.0 + np.sqrt(1.0 + 4.0 * over_cooling / resistance)) / 2.0
    first = 1.0 + high["temperature_coefficient"] * rise
    # Nothing grows in a time without end where there is no heat.
    reached = np.sqrt(first**2 + np.where(growth > 0.0, 2.0 * growth * duration / low["armature_resistance"], 0.0))
    warmest = np.maximum(first, np.minimum(settled, reached))
    return {
        "armature": float((resistance * warmest * inverse_inductance).max()),
        "cooling": float(high["cooling"].max()),
        "heating": float(np.minimum(fed_back, 4.0 * growth / low["armature_resistance"]).max()),
    }


def _free_speeds(low: Ends, high: Ends, volts: float) -> Array:
    """Highest speed that the motor of each pitch joint comes to free of load [rad/s], zero for the yaw."""
    # K V0 / (R D + K^2) is largest at K = sqrt(R D), or at the end of K's range that is nearest to it.
    braking = low["armature_resistance"] * low["friction"]
    constant = np.clip(np.sqrt(braking), low["joint_torque_constant"], high["joint_torque_constant"])
    free = volts / (braking / constant + constant)
    stalled = high["joint_torque_constant"] * volts / (low["armature_resistance"] * low["reflected_inertia"])
    return np.fmin(free, HOUR * stalled) * (np.arange(free.size) > 0)


def _motion_rates(every: Array, low: Ends, high: Ends, speed: Array) -> dict[str, float]:
    length, *_ = _links(every)
    longest, rotors = length.max(axis=0), low["reflected_inertia"][1:]
    # l / (r^2 / 4 + l^2 / 12) is largest at l = sqrt(3) r, or at the end of l's range that is nearest to it.
    radius = np.sqrt(2.0 * (low["axial_inertia"] / low["mass"])[1:])
    turning = np.clip(math.sqrt(3.0) * radius, length.min(axis=0), longest)
    lever = turning / cylinder_transverse_inertia(low["mass"][1:], radius, turning)
    beyond = np.cumsum(high["mass"][:0:-1])[::-1] - high["mass"][1:] / 2.0 + high["payload"][1:]

    def swing(pull: Array) -> float:
        """Fastest swing of a link that is stretched by `pull` [N] on its end [1/s]."""
        carried = np.cumsum((pull * longest)[::-1])[::-1]
        return math.sqrt(min(float((pull * lever).max()), float((carried / rotors).sum())))

    return {
        "gravity": swing(high["gravity"][1:] * beyond),
        "speed": float(speed[1:].sum()),
        "whirl": float(speed.max()) * swing(longest * beyond),
    }


def _contact_rates(every: Array, low: Ends, high: Ends, speed: Array, volts: float) -> dict[str, float]:
    length, mass, middle_inertia = _links(every)
    end_mass = low["mass"][1:] / (1.0 + mass * length**2 / (4.0 * middle_inertia)).max(axis=0)
    end_mass[-1] += low["payload"][-1]
    lightest, longest = float(end_mass.min()), float(length.max())
    # One table, one gravity and one payload: the same in every entry.
    shared = {name: float(high[name][0]) for name in ("gravity", "payload", "stiffness", "dissipation")}
    weight = shared["gravity"] * (float(high["mass"].sum()) + shared["payload"])
    stalled = volts * (high["joint_torque_constant"] / low["armature_resistance"])[1:]
    pressing = max(weight, PRESSING * float((stalled / length.min(axis=0)).max()))
    table = math.sqrt(shared["stiffness"] / lightest)
    impact = longest * float(speed.max()) + math.sqrt(shared["gravity"] * longest)
    sliding = pressing / float(low["mass"][1:].min())
    return {
        "table": table,
        "dissipation": max(
            table * math.sqrt(2.0 * shared["dissipation"] * impact), shared["dissipation"] * weight / lightest
        ),
        "sliding": float(high["table_friction"][0] / low["friction_velocity"][0]) * sliding,
        "rubbing": float(high["elbow_friction"][0]) / ELBOW_SPEED * sliding,
    }


def _links(every: Array) -> tuple[Array, Array, Array]:
    """Length [m], mass [kg] and inertia across the middle [kg m^2] of the links that pitch, each (arms, n - 1)."""
    length, mass, end_inertia = (every[:, PARAMETERS.index(name), 1:] for name in ("length", "mass", "end_inertia"))
    return length, mass, end_inertia - mass * length**2 / 4.0

"""The compiled core: the arm's O(n) articulated-body recursion, RK4 and energy meters, lanes innermost.

Coordinates inside are the yaw psi = q_1 and the absolute pitches phi_a, where the mass matrix is block diagonal. A
*block* is W arms side by side in one flat float64 workspace: record a holds joint a + 1 (record n the tip), each slot
of a record is a row of W lanes, so entry (record a, slot S, lane k) sits at `o + S + k` with o = a * STRIDE, and a pass
hands values on by writing its own record and reading the one before (`o - NEXT`) or after it (`o + NEXT`). One array,
constant slot offsets and straight bodies under `for k in range(LANES)` let LLVM prove that rows do not overlap, and
vectorise; strict floating point and the sine below keep every lane's bits the same for any W.

Symbols are those of the derivation: links have e = (sin phi, cos phi) in the (rho, z) plane and
e' = l (cos phi, -sin phi); K and b are the rest of the arm as its parent feels it; I_f3, d, r the joint's share.
This is the only file with compiled code: Numba's cache does not notice edits in another file's callee.
"""

# pyright: basic
# ruff: noqa: E741, ANN001, ANN201, ANN202, PLR0912, PLR0915

import sys
from collections.abc import Callable
from functools import cache
from threading import Timer
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

# Rows of a block's public arrays: state (B, STATE_ROWS, n) and parameters (B, PARAMETER_ROWS, n).
STATE = ("q", "q_dot", "current", "electrical_energy", "drawn_energy", "copper_loss", "friction_loss", "link_work")
STATE_ROWS = len(STATE)
# Behind them, in arrays for a kernel with a switch on: per joint or, for contacts, per contact point at the link's end;
# the supply's loss stands with joint 1.
SWITCHED_STATE = (
    "contact_loss", "temperature_rise", "supply_loss", "contact_radial", "contact_tangential", "contact_normal",
)  # fmt: skip
SWITCHED_STATE_ROWS = STATE_ROWS + len(SWITCHED_STATE)
PARAMETERS = (
    "length",
    "mass",
    "end_inertia",  # transverse inertia about the joint: I_t + m l^2 / 4
    "inertia_difference",  # I_t - I_s
    "axial_inertia",  # I_s
    "reflected_inertia",  # J_m
    "joint_torque_constant",  # K_m
    "friction",  # D + D_m
    "reflected_viscous_friction",  # D_m
    "armature_resistance",  # R
    "inverse_inductance",  # 1 / L
    "gravity",  # g, the same in every entry
    "payload",  # mass at the hand, the same in every entry
    # From here on only kernels with a switch on look.
    "stiffness",  # k of the table
    "dissipation",  # c
    "table_friction",  # mu
    "friction_velocity",  # v_s
    "elbow_friction",  # mu_e of the rigid elbows
    "reflected_coulomb_friction",  # T_c k
    "heating",  # 1 / C_th
    "cooling",  # 1 / (R_th C_th)
    "temperature_coefficient",  # alpha, or 0 while windings are not followed
    "sag",  # R_s / V0^2
    "bus_floor",  # least V0 I that the supply takes: 0, or far below without bound
)
PLAIN_PARAMETER_ROWS = 13
PARAMETER_ROWS = len(PARAMETERS)
# Columns of the per-arm summary (B, SUMMARY_COLUMNS + p): hand position, lowest joint or hand height, seconds spent
# below the table (accumulated), 1 while the state is representable, then one force per elbow.
HAND, LOWEST, BELOW_TABLE, VALID, SUMMARY_COLUMNS = 0, 3, 4, 5, 6
# Rows that `observe` fills beside the observation.
FIGURES = (
    "tracking_error",
    "electrical_power",
    "electrical_energy",
    "drawn_energy",
    "link_work",
    "reward_tracking",
    "reward_energy",
    "below_table",
    "reward",
)
# Beyond this angle [rad] the sine loses digits; an arm gets there only by blowing up.
LARGEST_ANGLE = 1e5
# Elbows rest at z = 0 to 1e-8 m; lower than this is under the table.
BELOW_TABLE_TOLERANCE = 1e-6
# A compliant table gives way: what touches it is under it from here on.
CONTACT_TOLERANCE = 1e-3
# Speeds over which friction of rigid elbows [m/s] and of gears [rad/s] comes up.
ELBOW_SPEED = 0.01
GEAR_SPEED = 0.05
MAXIMUM_ELBOWS = 8
# A projection onto the table is repeated while it turns a link by more than this [rad per m of it], so often at most.
SMALL_SHIFT = 1e-7
NEWTON_STEPS = 30
# Slots of a record, named below: those of every kernel, those of kernels with a switch on; then one per possible elbow,
# two where elbows rub.
SLOTS = 52
SWITCHED_SLOTS = 26

_ROUND = 6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to the nearest integer
_TWO_OVER_PI = 0.6366197723675814
# pi / 2 in three parts (fdlibm), so that the reduced angle stays exact for any angle an arm can reach.
_PIO2_1, _PIO2_2, _PIO2_3 = 1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


U = np.uint64
BLOCK_LANES = 16
PATIENCE = 2.0  # a compilation that takes longer [s] is announced
W = BLOCK_LANES  # the length of a row in the workspace
LANES = U(W)
(
    Q, QD, I, Q0, QD0, I0, QDA, IA, ELECTRICAL, DRAWN, COPPER, FRICTION, WORK, V,
    LENGTH, MASS, END_INERTIA, DIFFERENCE, AXIAL, ROTOR, KM, DAMPING, MOTOR_DAMPING, RESISTANCE, INVERSE_L,
    GRAVITY, PAYLOAD,
    PHI, OMEGA, SPIN, RHO, RHOD, SUMR, SUMZ, Z, YAW, YAWD, LOW, ER, EZ, FR, FZ, T, D,
    KRR, KRZ, KZZ, BR, BZ, B3, FREE, GAIN,
) = (U(W * row) for row in range(SLOTS))  # fmt: skip
(
    CONTACT_LOSS, TEMPERATURE, SUPPLY_LOSS, CONTACT_R, CONTACT_T, CONTACT_N,
    STIFFNESS, DISSIPATION, TABLE_FRICTION, FRICTION_SPEED, ELBOW_FRICTION, COULOMB, HEATING, COOLING, WARMING, SAG,
    BUS_FLOOR,
    PSID, ZD, TWIST, LOSS, GEAR, BUS, SHARE, TEMPERATURE0, TEMPERATUREA,
) = (U(W * (SLOTS + row)) for row in range(SWITCHED_SLOTS))  # fmt: skip
# Slots that one pass is done with serve the next: `inward` turns FR, FZ, T into I_f3 and r.
IR3, IZ3, R = FR, FZ, T
AR, AZ, ALPHA = CR, CZ, C3 = KRR, KRZ, KZZ
HEIGHT, RATE, GRAM = B3, BR, BZ
# What a kernel knows, decided when it is made: a compliant table, friction on rigid elbows, motors beyond the paper's.
TABLE, RUBBING, DRIVE = False, False, False
LOWEST_FREE = BELOW_TABLE_TOLERANCE
Y = W * SLOTS
X = Y + W * MAXIMUM_ELBOWS
# One row more, so that a slot of neighbouring records does not fall on the same cache lines.
STRIDE = W * (SLOTS + MAXIMUM_ELBOWS + 1)
NEXT = U(STRIDE)
# Rows of a block: the Delassus matrix and the elbow forces, time below the table, the projection's shift and mask; then
# what friction on elbows needs: the matrix again, what friction adds to it, the free accelerations, friction per newton
# of each elbow's force, radial and tangential, which elbows push, and how hard.
_MATRIX = MAXIMUM_ELBOWS * MAXIMUM_ELBOWS
FORCES = U(W * _MATRIX)
BELOW = U(W * (_MATRIX + MAXIMUM_ELBOWS))
SHIFT = BELOW + U(W)
ACTIVE = SHIFT + U(W)
PLAIN_TAIL = W * (_MATRIX + MAXIMUM_ELBOWS + 3)
MATRIX = U(PLAIN_TAIL)
COUPLING = MATRIX + U(W * _MATRIX)
FREE_RISE = COUPLING + U(W * _MATRIX)
SLIDE_R = FREE_RISE + U(W * MAXIMUM_ELBOWS)
SLIDE_T = SLIDE_R + U(W * MAXIMUM_ELBOWS)
PUSHING = SLIDE_T + U(W * MAXIMUM_ELBOWS)
PUSH = PUSHING + U(W * MAXIMUM_ELBOWS)
TAIL = W * (3 * _MATRIX + 6 * MAXIMUM_ELBOWS + 3)
# Everything above that is measured in lanes, and the templates that are inlined into their callers.
SCALED = (
    "W", "LANES", "FORCES", "BELOW", "SHIFT", "ACTIVE", "TAIL",
    "MATRIX", "COUPLING", "FREE_RISE", "SLIDE_R", "SLIDE_T", "PUSHING", "PUSH",
    "Q", "QD", "I", "Q0", "QD0", "I0", "QDA", "IA", "ELECTRICAL", "DRAWN", "COPPER", "FRICTION", "WORK", "V",
    "LENGTH", "MASS", "END_INERTIA", "DIFFERENCE", "AXIAL", "ROTOR", "KM", "DAMPING", "MOTOR_DAMPING", "RESISTANCE",
    "INVERSE_L", "GRAVITY", "PAYLOAD", "PHI", "OMEGA", "SPIN", "RHO", "RHOD", "SUMR", "SUMZ", "Z", "YAW", "YAWD", "LOW",
    "ER", "EZ", "FR", "FZ", "T", "D", "KRR", "KRZ", "KZZ", "BR", "BZ", "B3", "FREE", "GAIN",
    "IR3", "IZ3", "R", "AR", "AZ", "ALPHA", "CR", "CZ", "C3", "HEIGHT", "RATE", "GRAM",
    "CONTACT_LOSS", "TEMPERATURE", "SUPPLY_LOSS", "CONTACT_R", "CONTACT_T", "CONTACT_N", "STIFFNESS", "DISSIPATION",
    "TABLE_FRICTION", "FRICTION_SPEED", "ELBOW_FRICTION", "COULOMB", "HEATING", "COOLING", "WARMING", "SAG",
    "BUS_FLOOR", "PSID", "ZD", "TWIST", "LOSS", "GEAR", "BUS", "SHARE", "TEMPERATURE0", "TEMPERATUREA",
)  # fmt: skip
INLINED = ("sincos", "contact", "gear", "joint", "stage")


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


def _compiled(function, cached=False, inlined=False):
    """The compiled function, without a cache on disk where no folder can be written."""
    try:
        return njit(nogil=True, error_model="numpy", cache=cached, forceinline=inlined)(function)
    except RuntimeError:
        return njit(nogil=True, error_model="numpy", forceinline=inlined)(function)


_sincos = _compiled(sincos)


def _multiply_and_add(context, a, b, c):
    def generate(_, builder, __, values):
        return builder.fma(*values)

    return types.float64(types.float64, types.float64, types.float64), generate


_rounded_once: Any = intrinsic(_multiply_and_add)


@_compiled
def fused(a, b, c):
    """A b + c of floats, rounded once."""
    return _rounded_once(a, b, c)


@_compiled
def _path_point(coefficients, c, s, out):
    ch, sh = c, s
    for axis in range(3):
        out[axis] = coefficients[0, axis]
    for h in range(1, coefficients.shape[0], 2):
        for axis in range(3):
            out[axis] += coefficients[h, axis] * ch + coefficients[h + 1, axis] * sh
        ch, sh = ch * c - sh * s, sh * c + ch * s


def _drive(action, highest, volts, voltage):
    """Fills voltage (B, n) with the clipped action (B, n) in volts. False when an action is not a number.

    highest (B,) is each arm's largest action, volts (B,) what a unit of it is.
    """
    numbers = True
    for b in range(action.shape[0]):
        for a in range(action.shape[1]):
            value = action[b, a]
            numbers = numbers and not np.isnan(value)
            voltage[b, a] = min(max(value, -highest[b]), highest[b]) * volts[b]
    return numbers


def _path(coefficients, angle, out):
    """Points out (m, 3) of a closed path at angles (m,): a Fourier series, rows 1, cos, sin, cos 2, sin 2..."""
    for i in range(angle.size):
        s, c = _sincos(angle[i])
        _path_point(coefficients, c, s, out[i])


def _observe(
    state, summary, pose, coefficients, angle, lookahead, scale, high, price, spent, observation, figures, first, end
):
    """Fills observation (B, size) float32 and the rows FIGURES of figures, (9, B), for arms first..end-1.

    coefficients (B, rows, 3) and angle (B,) are each arm's path and where the target stands on it, lookahead (B,) the
    angle to what it looks ahead to. price is the tracking weight [1/m], the energy weight [1/W], the control frequency
    [Hz] and whether negative power counts; spent (B,) is the energy paid before [J], and is brought up to date.
    In compiled code so that an arm's bits do not depend on how many others there are.
    """
    n = state.shape[2]
    later = np.empty(3)
    target = np.empty(3)
    tracking_weight, energy_weight, frequency, regeneration = price
    for b in range(first, end):
        s, c = _sincos(angle[b])
        _path_point(coefficients[b], c, s, target)
        s_later, c_later = _sincos(angle[b] + lookahead[b])
        _path_point(coefficients[b], c_later, s_later, later)
        squared = 0.0
        for m in range(3 * n + 11):
            axis = (m - 3 * n) % 3
            if m < n:
                value = state[b, 0, m] - pose[m]
            elif m < 2 * n:
                value = state[b, 1, m - n]
            elif m < 3 * n:
                value = state[b, 2, m - 2 * n]
            elif m < 3 * n + 3:
                value = summary[b, HAND + axis] - target[axis]
                squared += value * value
            elif m < 3 * n + 6:
                value = summary[b, HAND + axis] - coefficients[b, 0, axis]
            elif m < 3 * n + 9:
                value = summary[b, HAND + axis] - later[axis]
            else:
                value = c if m == 3 * n + 9 else s
            observation[b, m] = min(max(np.float32(value / scale[m]), -high[m]), high[m])
        for row, meter in ((2, 3), (3, 4), (4, 7)):
            total = 0.0
            for a in range(n):
                total += state[b, meter, a]
            figures[row, b] = total
        paid = figures[2, b] if regeneration else figures[3, b]
        figures[0, b] = np.sqrt(squared)
        figures[1, b] = (paid - spent[b]) * frequency
        figures[5, b] = 0.0 - tracking_weight * figures[0, b]
        figures[6, b] = 0.0 - energy_weight * figures[1, b]
        figures[7, b] = summary[b, BELOW_TABLE]
        figures[8, b] = fused(-figures[1, b], energy_weight, figures[5, b])
        spent[b] = paid


Compiled = Callable[..., Any]
drive: Compiled = _compiled(_drive, cached=True)
path: Compiled = _compiled(_path, cached=True)
observe: Compiled = _compiled(_observe, cached=True)


def project(ws, tail, elbows):
    """Newton steps of pose and rates onto the elbows' plane, least change of absolute pitch.

    Mostly one: the drift is the integrator's local error, whose square is below rounding. Near a segment that stands
    upright it takes more. A lane stops by its own shift, so its bits do not depend on its neighbours'.
    """
    lanes = min(LANES, U(ws.size))
    for k in range(lanes):
        tail[ACTIVE + k] = 1.0
    for _ in range(NEWTON_STEPS):
        newton(ws, tail, elbows)
        moving = 0.0
        for k in range(lanes):
            moving = max(moving, tail[ACTIVE + k])
        if moving == 0.0:
            break


def newton(ws, tail, elbows):
    """One step of `project` in the active lanes; those stay active that it has moved far.

    All elbows lie at z = 0, so the links between two neighbours close on their own and no matrix is solved.
    """
    lanes = min(LANES, U(ws.size))
    first = 1
    for k in range(lanes):
        tail[SHIFT + k] = 0.0
    for j in range(elbows.size):
        last = elbows[j] - 2
        o = U((first - 1) * STRIDE)
        for k in range(lanes):
            ws[o + HEIGHT + k] = 0.0
            ws[o + RATE + k] = 0.0
            # A floor far below any real lever arm keeps a segment that stands upright finite.
            ws[o + GRAM + k] = 1e-12
        for a in range(first, last + 1):
            o = U(a * STRIDE)
            for k in range(LANES):
                phi = ws[o - NEXT + PHI + k] + ws[o + Q + k]
                omega = ws[o - NEXT + OMEGA + k] + ws[o + QD + k]
                s, c = sincos(phi)
                length = ws[o + LENGTH + k]
                ls = length * s
                ws[o + PHI + k] = phi
                ws[o + OMEGA + k] = omega
                ws[o + HEIGHT + k] = ws[o - NEXT + HEIGHT + k] + length * c
                ws[o + RATE + k] = ws[o - NEXT + RATE + k] - ls * omega
                ws[o + GRAM + k] = ws[o - NEXT + GRAM + k] + ls * ls
                ws[o + ER + k] = ls
        o = U(last * STRIDE)
        for k in range(lanes):
            scale = tail[ACTIVE + k] / ws[o + GRAM + k]
            height = ws[o + HEIGHT + k] * scale
            rate = ws[o + RATE + k] * scale
            ws[o + HEIGHT + k] = height
            ws[o + RATE + k] = rate
            # The next segment counts its pitch from here, and its first joint is about to take the shift back.
            ws[o + PHI + k] += ws[o + ER + k] * height
            ws[o + OMEGA + k] += ws[o + ER + k] * rate
            tail[SHIFT + k] = max(tail[SHIFT + k], abs(height))
        # Tip to base: a link's own absolute shift, which the link after it takes back from its relative angle.
        for a in range(last, first - 1, -1):
            o = U(a * STRIDE)
            for k in range(LANES):
                height = ws[o + HEIGHT + k]
                rate = ws[o + RATE + k]
                shift = ws[o + ER + k] * height
                kick = ws[o + ER + k] * rate
                ws[o - NEXT + HEIGHT + k] = height
                ws[o - NEXT + RATE + k] = rate
                ws[o + Q + k] += shift
                ws[o + QD + k] += kick
                ws[o + NEXT + Q + k] -= shift
                ws[o + NEXT + QD + k] -= kick
        first = last + 1
    for k in range(lanes):
        tail[ACTIVE + k] = 1.0 if tail[SHIFT + k] > SMALL_SHIFT else 0.0


def contact(ws, o, k, rho, rhod, z, zd):
    """The compliant table's force on the end of a link, the torque about the yaw so far, and the power lost."""
    psid = ws[o - NEXT + PSID + k]
    slide = rho * psid
    speed = ws[o + FRICTION_SPEED + k]
    spring = ws[o + STIFFNESS + k] * max(-z, 0.0)
    normal = max(spring * (1.0 - ws[o + DISSIPATION + k] * zd), 0.0)
    drag = -ws[o + TABLE_FRICTION + k] * normal / np.sqrt(rhod * rhod + slide * slide + speed * speed)
    radial = drag * rhod
    tangential = drag * slide
    ws[o + PSID + k] = psid
    ws[o + ZD + k] = zd
    ws[o + CONTACT_R + k] = radial
    ws[o + CONTACT_T + k] = tangential
    ws[o + CONTACT_N + k] = normal
    ws[o + TWIST + k] = ws[o - NEXT + TWIST + k] + rho * tangential
    ws[o + LOSS + k] = (spring - normal) * zd - (radial * rhod + tangential * slide)


def gear(ws, o, k):
    """Torque of the gear's Coulomb friction along the joint's motion."""
    q_dot = ws[o + QD + k]
    torque = ws[o + COULOMB + k] * q_dot / np.sqrt(q_dot * q_dot + GEAR_SPEED * GEAR_SPEED)
    ws[o + GEAR + k] = torque
    return torque


def outward(ws, n):
    """Positions, velocity products, yaw inertia and each link's inertial and gravity force, base to tip."""
    if DRIVE:
        for k in range(LANES):
            ws[BUS + k] = ws[V + k] * ws[I + k]
    for a in range(1, n):
        o = U(a * STRIDE)
        for k in range(LANES):
            phi = ws[o - NEXT + PHI + k] + ws[o + Q + k]
            w = ws[o - NEXT + OMEGA + k] + ws[o + QD + k]
            s, c = sincos(phi)
            m = ws[o + MASS + k]
            half = 0.5 * ws[o + LENGTH + k]
            difference = ws[o + DIFFERENCE + k]
            spin = ws[o - NEXT + SPIN + k]
            hs = half * s
            hc = half * c
            ww = w * w
            rho = ws[o - NEXT + RHO + k] + hs
            rhod = ws[o - NEXT + RHOD + k] + hc * w
            sumr = ws[o - NEXT + SUMR + k] - hs * ww
            sumz = ws[o - NEXT + SUMZ + k] - hc * ww
            z = ws[o - NEXT + Z + k] + 2.0 * hc
            fr = m * (sumr - rho * spin)
            fz = m * (sumz + ws[o + GRAVITY + k])
            dsc = difference * s * c
            ws[o + PHI + k] = phi
            ws[o + OMEGA + k] = w
            ws[o + SPIN + k] = spin
            ws[o + RHO + k] = rho + hs
            ws[o + RHOD + k] = rhod + hc * w
            ws[o + SUMR + k] = sumr - hs * ww
            ws[o + SUMZ + k] = sumz - hc * ww
            ws[o + Z + k] = z
            ws[o + LOW + k] = min(ws[o - NEXT + LOW + k], z)
            ws[o + YAW + k] = ws[o - NEXT + YAW + k] + (m * rho * rho + (difference * s * s + ws[o + AXIAL + k]))
            ws[o + YAWD + k] = ws[o - NEXT + YAWD + k] + 2.0 * (m * rho * rhod + dsc * w)
            ws[o + ER + k] = 2.0 * hc
            ws[o + EZ + k] = -2.0 * hs
            ws[o + FR + k] = fr
            ws[o + FZ + k] = fz
            ws[o + T + k] = hc * fr - hs * fz - dsc * spin
            if TABLE:
                contact(ws, o, k, rho + hs, rhod + hc * w, z, ws[o - NEXT + ZD + k] - 2.0 * hs * w)
            if DRIVE:
                ws[o + BUS + k] = ws[o - NEXT + BUS + k] + ws[o + V + k] * ws[o + I + k]


def inward(ws, n):
    """Articulated inertia K and bias b, tip to base; starts from the payload at the tip."""
    o = U(n * STRIDE)
    for k in range(LANES):
        load = ws[o - NEXT + PAYLOAD + k]
        ws[o + KRR + k] = load
        ws[o + KRZ + k] = 0.0
        ws[o + KZZ + k] = load
        ws[o + IR3 + k] = 0.0
        ws[o + IZ3 + k] = 0.0
        ws[o + D + k] = 0.0
        ws[o + BR + k] = load * (ws[o - NEXT + SUMR + k] - ws[o - NEXT + RHO + k] * ws[o - NEXT + SPIN + k])
        ws[o + BZ + k] = load * (ws[o - NEXT + SUMZ + k] + ws[o - NEXT + GRAVITY + k])
        ws[o + B3 + k] = 0.0
    for a in range(n - 1, 0, -1):
        o = U(a * STRIDE)
        for k in range(LANES):
            er = ws[o + ER + k]
            ez = ws[o + EZ + k]
            m = ws[o + MASS + k]
            j = ws[o + ROTOR + k]
            krr = ws[o + NEXT + KRR + k]
            krz = ws[o + NEXT + KRZ + k]
            kzz = ws[o + NEXT + KZZ + k]
            # The rest's rotational inertia, out of what the joint after this one keeps anyway: stores cost most here.
            jd = ws[o + NEXT + ROTOR + k] * ws[o + NEXT + D + k]
            kr3 = jd * ws[o + NEXT + IR3 + k]
            kz3 = jd * ws[o + NEXT + IZ3 + k]
            k33 = ws[o + NEXT + ROTOR + k] - ws[o + NEXT + ROTOR + k] * jd
            br = ws[o + NEXT + BR + k]
            bz = ws[o + NEXT + BZ + k]
            if TABLE:
                br -= ws[o + CONTACT_R + k]
                bz -= ws[o + CONTACT_N + k]
            gr = krr * er + krz * ez + kr3
            gz = krz * er + kzz * ez + kz3
            ir3 = 0.5 * m * er + gr
            iz3 = 0.5 * m * ez + gz
            i33 = (ws[o + END_INERTIA + k] + k33) + (er * (gr + kr3) + ez * (gz + kz3))
            u = ws[o + KM + k] * ws[o + I + k] - ws[o + DAMPING + k] * ws[o + QD + k]
            if DRIVE:
                u -= gear(ws, o, k)
            r = (u - ws[o + T + k] - ws[o + NEXT + B3 + k]) - (er * br + ez * bz)
            d = 1.0 / (i33 + j)
            dr = d * r
            ws[o + KRR + k] = m + krr - d * ir3 * ir3
            ws[o + KRZ + k] = krz - d * ir3 * iz3
            ws[o + KZZ + k] = m + kzz - d * iz3 * iz3
            ws[o + BR + k] = ws[o + FR + k] + br + dr * ir3
            ws[o + BZ + k] = ws[o + FZ + k] + bz + dr * iz3
            ws[o + B3 + k] = u - j * dr
            ws[o + IR3 + k] = ir3
            ws[o + IZ3 + k] = iz3
            ws[o + R + k] = r
            ws[o + D + k] = d


def solve(tail, lanes, p):
    """Elbow forces -W^-1 f in place of f, by Cholesky W = L L^T in place; the diagonal then holds 1 / L_jj."""
    for j in range(p):
        row = U(j * MAXIMUM_ELBOWS * W)
        force = FORCES + U(j * W)
        diagonal = row + U(j * W)
        for i in range(j):
            other = U(i * MAXIMUM_ELBOWS * W)
            entry = row + U(i * W)
            for m in range(i):
                for k in range(lanes):
                    tail[entry + k] -= tail[row + U(m * W) + k] * tail[other + U(m * W) + k]
            for k in range(lanes):
                tail[entry + k] *= tail[other + U(i * W) + k]
        for m in range(j):
            for k in range(lanes):
                lower = tail[row + U(m * W) + k]
                tail[diagonal + k] -= lower * lower
                tail[force + k] -= lower * tail[FORCES + U(m * W) + k]
        for k in range(lanes):
            # Elbows that cannot move against each other leave nothing to solve for: the floor keeps that finite.
            inverse = 1.0 / np.sqrt(max(tail[diagonal + k], 1e-12))
            tail[diagonal + k] = inverse
            tail[force + k] *= inverse
    for j in range(p - 1, -1, -1):
        force = FORCES + U(j * W)
        diagonal = U((j * MAXIMUM_ELBOWS + j) * W)
        for m in range(j + 1, p):
            entry = U((m * MAXIMUM_ELBOWS + j) * W)
            for k in range(lanes):
                # Forces already solved carry their final minus sign.
                tail[force + k] += tail[entry + k] * tail[FORCES + U(m * W) + k]
        for k in range(lanes):
            tail[force + k] *= -tail[diagonal + k]


def rub(ws, tail, n, elbows):
    """Friction of the elbows that push, and elbow forces that agree with it; `solve` finds the forces without it.

    Friction enters the columns of the active elbows, at first those that push without friction, then those that push
    with it, until they stay the same; the friction found is then held, so that it opposes the sliding in any case.
    """
    lanes = min(LANES, U(ws.size))
    p = elbows.size
    tip = U((n - 1) * STRIDE)
    if not TABLE:
        for k in range(lanes):
            ws[tip + TWIST + k] = 0.0
    couple(ws, tail, lanes, elbows)
    solve(tail, lanes, p)
    for _ in range(p + 2):
        for j in range(p):
            for k in range(lanes):
                tail[PUSHING + U(j * W) + k] = 1.0 if tail[FORCES + U(j * W) + k] > 0.0 else 0.0
        eliminate(tail, lanes, p)
        changed = 0.0
        for j in range(p):
            for k in range(lanes):
                pushes = 1.0 if tail[FORCES + U(j * W) + k] > 0.0 else 0.0
                changed = max(changed, abs(pushes - tail[PUSHING + U(j * W) + k]))
        if changed == 0.0:
            break
    hold(ws, tail, lanes, tip, elbows)


def couple(ws, tail, lanes, elbows):
    """Keeps the matrix and the free accelerations, and finds what friction adds: the rise at i for a newton on j."""
    p = elbows.size
    for j in range(p):
        slide(ws, tail, lanes, elbows[j], j)
    for j in range(p):
        for k in range(lanes):
            tail[FREE_RISE + U(j * W) + k] = tail[FORCES + U(j * W) + k]
        for i in range(p):
            entry = U((i * MAXIMUM_ELBOWS + j) * W)
            symmetric = U((max(i, j) * MAXIMUM_ELBOWS + min(i, j)) * W)
            for k in range(lanes):
                tail[MATRIX + entry + k] = tail[symmetric + k]
                tail[COUPLING + entry + k] = 0.0
            for a in range(1, min(elbows[i], elbows[j]) - 1):
                o = U(a * STRIDE)
                for k in range(lanes):
                    tail[COUPLING + entry + k] += ws[o + D + k] * ws[o + U(Y + i * W) + k] * ws[o + U(X + j * W) + k]


def hold(ws, tail, lanes, tip, elbows):
    """Puts the friction that was found on the arm and its loss on the meter; what is left to solve is the forces."""
    p = elbows.size
    for j in range(p):
        for k in range(lanes):
            tail[PUSH + U(j * W) + k] = max(tail[FORCES + U(j * W) + k], 0.0)
    for i in range(p):
        for k in range(lanes):
            tail[FORCES + U(i * W) + k] = tail[FREE_RISE + U(i * W) + k]
        for j in range(p):
            entry = U((i * MAXIMUM_ELBOWS + j) * W)
            for k in range(lanes):
                tail[entry + k] = tail[MATRIX + entry + k]
                tail[FORCES + U(i * W) + k] += tail[COUPLING + entry + k] * tail[PUSH + U(j * W) + k]
    for j in range(p):
        x_slot = U(X + j * W)
        push = PUSH + U(j * W)
        for a in range(1, elbows[j] - 1):
            o = U(a * STRIDE)
            for k in range(lanes):
                ws[o + R + k] += ws[o + x_slot + k] * tail[push + k]
        o = U((elbows[j] - 2) * STRIDE)
        for k in range(lanes):
            radial = tail[SLIDE_R + U(j * W) + k] * tail[push + k]
            tangential = tail[SLIDE_T + U(j * W) + k] * tail[push + k]
            lost = -(radial * ws[o + RHOD + k] + tangential * ws[o + RHO + k] * ws[QD + k])
            ws[o + LOSS + k] = ws[o + LOSS + k] + lost if TABLE else lost
            ws[tip + TWIST + k] += tangential * ws[o + RHO + k]


def slide(ws, tail, lanes, elbow, j):
    """Friction per newton of an elbow's force, and x, the recursion's answer to its radial part."""
    o = U((elbow - 2) * STRIDE)
    for k in range(lanes):
        radial = ws[o + RHOD + k]
        tangential = ws[o + RHO + k] * ws[QD + k]
        speed = np.sqrt(radial * radial + tangential * tangential + ELBOW_SPEED * ELBOW_SPEED)
        share = -ws[o + ELBOW_FRICTION + k] / speed
        tail[SLIDE_R + U(j * W) + k] = share * radial
        tail[SLIDE_T + U(j * W) + k] = share * tangential
        ws[o + NEXT + CR + k] = -share * radial
        ws[o + NEXT + CZ + k] = 0.0
        ws[o + NEXT + C3 + k] = 0.0
    for a in range(elbow - 2, 0, -1):
        o = U(a * STRIDE)
        for k in range(LANES):
            cr = ws[o + NEXT + CR + k]
            cz = ws[o + NEXT + CZ + k]
            x = -((ws[o + ER + k] * cr + ws[o + EZ + k] * cz) + ws[o + NEXT + C3 + k])
            dx = ws[o + D + k] * x
            ws[o + CR + k] = cr + dx * ws[o + IR3 + k]
            ws[o + CZ + k] = cz + dx * ws[o + IZ3 + k]
            ws[o + C3 + k] = -ws[o + ROTOR + k] * dx
            ws[o + U(X + j * W) + k] = x


def eliminate(tail, lanes, p):
    """Elbow forces with the friction of those that push: Gauss on the matrix and what friction adds to it."""
    for i in range(p):
        for k in range(lanes):
            tail[FORCES + U(i * W) + k] = -tail[FREE_RISE + U(i * W) + k]
        for j in range(p):
            entry = U((i * MAXIMUM_ELBOWS + j) * W)
            for k in range(lanes):
                rubbing = tail[PUSHING + U(j * W) + k] * tail[COUPLING + entry + k]
                tail[entry + k] = tail[MATRIX + entry + k] + rubbing
    for j in range(p):
        pivot = U((j * MAXIMUM_ELBOWS + j) * W)
        for i in range(j + 1, p):
            lead = U((i * MAXIMUM_ELBOWS + j) * W)
            for k in range(lanes):
                tail[lead + k] /= tail[pivot + k]
                tail[FORCES + U(i * W) + k] -= tail[lead + k] * tail[FORCES + U(j * W) + k]
            for m in range(j + 1, p):
                entry = U((i * MAXIMUM_ELBOWS + m) * W)
                above = U((j * MAXIMUM_ELBOWS + m) * W)
                for k in range(lanes):
                    tail[entry + k] -= tail[lead + k] * tail[above + k]
    for j in range(p - 1, -1, -1):
        force = FORCES + U(j * W)
        for m in range(j + 1, p):
            entry = U((j * MAXIMUM_ELBOWS + m) * W)
            for k in range(lanes):
                tail[force + k] -= tail[entry + k] * tail[FORCES + U(m * W) + k]
        for k in range(lanes):
            tail[force + k] /= tail[U((j * MAXIMUM_ELBOWS + j) * W) + k]


def brace(ws, tail, n, elbows):
    """Elbow forces: f = -W^-1 z_ddot_free, with W = sum of d y y^T and z_ddot_free = sum of d y r + J_dot q_dot.

    y is the recursion's answer to a unit +z force at an elbow; the forces then add sum of y f to r.
    """
    # An opaque trip count: LLVM would unroll short bodies of a known one into scalar code.
    lanes = min(LANES, U(ws.size))
    for j in range(elbows.size):
        last = elbows[j] - 2
        y_slot = U(Y + j * W)
        row = U(j * MAXIMUM_ELBOWS * W)
        o = U(last * STRIDE)
        for k in range(lanes):
            ws[o + NEXT + CR + k] = 0.0
            ws[o + NEXT + CZ + k] = -1.0
            ws[o + NEXT + C3 + k] = 0.0
            ws[o + NEXT + FREE + k] = ws[o + SUMZ + k]
            ws[o + NEXT + GAIN + k] = 0.0
        for a in range(last, 0, -1):
            o = U(a * STRIDE)
            for k in range(LANES):
                cr = ws[o + NEXT + CR + k]
                cz = ws[o + NEXT + CZ + k]
                y = -((ws[o + ER + k] * cr + ws[o + EZ + k] * cz) + ws[o + NEXT + C3 + k])
                dy = ws[o + D + k] * y
                ws[o + CR + k] = cr + dy * ws[o + IR3 + k]
                ws[o + CZ + k] = cz + dy * ws[o + IZ3 + k]
                ws[o + C3 + k] = -ws[o + ROTOR + k] * dy
                ws[o + FREE + k] = ws[o + NEXT + FREE + k] + dy * ws[o + R + k]
                ws[o + GAIN + k] = ws[o + NEXT + GAIN + k] + dy * y
                ws[o + y_slot + k] = y
        for k in range(lanes):
            tail[row + U(j * W) + k] = ws[NEXT + GAIN + k]
            tail[FORCES + U(j * W) + k] = ws[NEXT + FREE + k]
        for i in range(j):
            other = U(Y + i * W)
            entry = row + U(i * W)
            for k in range(lanes):
                tail[entry + k] = 0.0
            for a in range(1, elbows[i] - 1):
                o = U(a * STRIDE)
                for k in range(lanes):
                    tail[entry + k] += ws[o + D + k] * ws[o + y_slot + k] * ws[o + other + k]
    if RUBBING:
        rub(ws, tail, n, elbows)
    solve(tail, lanes, elbows.size)
    for j in range(elbows.size):
        y_slot = U(Y + j * W)
        force = FORCES + U(j * W)
        for a in range(1, elbows[j] - 1):
            o = U(a * STRIDE)
            for k in range(lanes):
                ws[o + R + k] += ws[o + y_slot + k] * tail[force + k]


def evaluate(ws, tail, n, elbows):
    """All that the joint accelerations are made of, at the current stage's state."""
    outward(ws, n)
    inward(ws, n)
    brace(ws, tail, n, elbows)


def joint(ws, o, k, q_ddot, weight, ahead, first, last):
    """Adds one RK4 stage of a joint to the step's increments and meters, and sets its next state.

    `weight` is the stage's share of the step [s], `ahead` how far off the next stage is, in the last one the step.
    """
    q = ws[o + Q + k] if first else ws[o + Q0 + k]
    q_dot = ws[o + QD + k]
    i = ws[o + I + k]
    qd = q_dot if first else ws[o + QD0 + k]
    i0 = i if first else ws[o + I0 + k]
    v = ws[o + V + k]
    resistance = ws[o + RESISTANCE + k]
    if DRIVE:
        v *= ws[o + SHARE + k]
        warmth = ws[o + TEMPERATURE + k]
        resistance *= 1.0 + ws[o + WARMING + k] * warmth
        warmth0 = warmth if first else ws[o + TEMPERATURE0 + k]
        warmer = weight * (ws[o + HEATING + k] * (resistance * i * i) - ws[o + COOLING + k] * warmth)
        heat = ahead * (ws[o + HEATING + k] * (resistance * i * i) - ws[o + COOLING + k] * warmth)
        if first:
            ws[o + TEMPERATURE0 + k] = warmth0
        else:
            warmer += ws[o + TEMPERATUREA + k]
        ws[o + TEMPERATUREA + k] = warmer
        ws[o + TEMPERATURE + k] = warmth0 + (warmer if last else heat)
    km = ws[o + KM + k]
    i_dot = (v - resistance * i - km * q_dot) * ws[o + INVERSE_L + k]
    power = v * i
    torque = km * i - ws[o + ROTOR + k] * q_ddot - ws[o + MOTOR_DAMPING + k] * q_dot
    ws[o + ELECTRICAL + k] += weight * power
    ws[o + DRAWN + k] += weight * max(power, 0.0)
    ws[o + COPPER + k] += weight * (resistance * i * i)
    friction = ws[o + DAMPING + k] * q_dot * q_dot
    if DRIVE:
        torque -= ws[o + GEAR + k]
        friction += ws[o + GEAR + k] * q_dot
    if TABLE or RUBBING:
        ws[o + CONTACT_LOSS + k] += weight * ws[o + LOSS + k]
    ws[o + FRICTION + k] += weight * friction
    ws[o + WORK + k] += weight * (torque * q_dot)
    qda = weight * q_ddot
    ia = weight * i_dot
    if first:
        ws[o + Q0 + k] = q
        ws[o + QD0 + k] = qd
        ws[o + I0 + k] = i0
    else:
        qda += ws[o + QDA + k]
        ia += ws[o + IA + k]
    if last:
        # The angle's own increment, out of what the stages left behind: one row less to keep.
        shift = ahead * qd
        ws[o + Q + k] = (
            q + (shift + ahead * ws[o + QDA + k]) - (ws[o + Q + k] - q - shift) * (1.0 / 3.0) - weight * (q_dot - qd)
        )
        ws[o + QD + k] = qd + qda
        ws[o + I + k] = i0 + ia
    else:
        ws[o + QDA + k] = qda
        ws[o + IA + k] = ia
        ws[o + Q + k] = q + ahead * q_dot
        ws[o + QD + k] = qd + ahead * q_ddot
        ws[o + I + k] = i0 + ahead * i_dot


def stage(ws, n, weight, ahead, first, last):
    """Joint accelerations, base to tip (the yaw stands alone), and what the stage makes of them."""
    end = U((n - 1) * STRIDE)
    # A loop of its own: whether rows of the tip and of the base overlap shows only at run time, and with all rows of
    # `joint` in the loop LLVM gives up on testing for that and leaves it scalar.
    for k in range(LANES):
        load = ws[end + PAYLOAD + k]
        rho = ws[end + RHO + k]
        inertia = ws[end + YAW + k] + load * rho * rho + ws[ROTOR + k]
        rate = ws[end + YAWD + k] + 2.0 * load * rho * ws[end + RHOD + k]
        u = ws[KM + k] * ws[I + k] - ws[DAMPING + k] * ws[QD + k]
        if TABLE or RUBBING:
            u += ws[end + TWIST + k]
        if DRIVE:
            u -= gear(ws, U(0), k)
            drawn = max(ws[end + BUS + k], ws[BUS_FLOOR + k])
            ws[SHARE + k] = 1.0 - ws[SAG + k] * drawn
            ws[SUPPLY_LOSS + k] += weight * (ws[SAG + k] * drawn * drawn)
        ws[R + k] = (u - rate * ws[QD + k]) / inertia
    for k in range(LANES):
        joint(ws, U(0), k, ws[R + k], weight, ahead, first, last)
        ws[SPIN + k] = ws[QD + k] * ws[QD + k]
        if TABLE:
            ws[PSID + k] = ws[QD + k]
    for a in range(1, n):
        o = U(a * STRIDE)
        for k in range(LANES):
            if DRIVE:
                ws[o + SHARE + k] = ws[o - NEXT + SHARE + k]
            ar = ws[o - NEXT + AR + k]
            az = ws[o - NEXT + AZ + k]
            before = ws[o - NEXT + ALPHA + k]
            load = ws[o + IR3 + k] * ar + ws[o + IZ3 + k] * az
            alpha = ws[o + D + k] * ((ws[o + R + k] + ws[o + ROTOR + k] * before) - load)
            ws[o + ALPHA + k] = alpha
            ws[o + AR + k] = ar + ws[o + ER + k] * alpha
            ws[o + AZ + k] = az + ws[o + EZ + k] * alpha
            joint(ws, o, k, alpha - before, weight, ahead, first, last)


def first_stage(ws, n, weight, ahead):
    """Stage 1, which keeps the state that the step starts from."""
    stage(ws, n, weight, ahead, True, False)


def middle_stage(ws, n, weight, ahead):
    """Stages 2 and 3."""
    stage(ws, n, weight, ahead, False, False)


def last_stage(ws, n, weight, ahead):
    """Stage 4, whose next state is the step's end."""
    stage(ws, n, weight, ahead, False, True)


def workspace(n):
    """Zeroed records of joints and tip, and a block's rows, on cache lines' edges, which vectors must not straddle."""
    whole = np.zeros((n + 1) * STRIDE + TAIL + 8)
    edge = (-whole.ctypes.data % 64) // 8
    ws = whole[edge : edge + (n + 1) * STRIDE]
    return ws, whole[edge + (n + 1) * STRIDE : edge + (n + 1) * STRIDE + TAIL]


def load(ws, n, start, state, parameters, voltage):
    """Lanes from arms start, start + 1, ...; lanes past the last arm repeat it and are never stored."""
    for lane in range(W):
        arm = min(start + lane, state.shape[0] - 1)
        for a in range(n):
            o = U(a * STRIDE + lane)
            for row in range(3):
                ws[o + U(row * W)] = state[arm, row, a]
            for row in range(5):
                ws[o + ELECTRICAL + U(row * W)] = state[arm, 3 + row, a]
            ws[o + V] = voltage[arm, a]
            for row in range(PLAIN_PARAMETER_ROWS):
                ws[o + LENGTH + U(row * W)] = parameters[arm, row, a]
            if TABLE or RUBBING or DRIVE:
                for row in range(3):
                    ws[o + CONTACT_LOSS + U(row * W)] = state[arm, STATE_ROWS + row, a]
                for row in range(PARAMETER_ROWS - PLAIN_PARAMETER_ROWS):
                    ws[o + STIFFNESS + U(row * W)] = parameters[arm, PLAIN_PARAMETER_ROWS + row, a]
        k = U(lane)
        ws[SPIN + k] = ws[QD + k] * ws[QD + k]
        if TABLE:
            ws[PSID + k] = ws[QD + k]
        ws[YAW + k] = ws[AXIAL + k]
        ws[LOW + k] = np.inf


def unload(ws, tail, n, lane, elbows, out, summary):
    """Writes a lane back; a state that cannot be represented stays as it was, with VALID at zero."""
    k = U(lane)
    valid = True
    for a in range(n):
        o = U(a * STRIDE + lane)
        # Not-a-number and infinity fail the comparison or turn the product into not-a-number.
        meters = ws[o + ELECTRICAL] + ws[o + COPPER] + ws[o + FRICTION] + ws[o + WORK]
        if TABLE or RUBBING or DRIVE:
            meters += ws[o + CONTACT_LOSS] + ws[o + TEMPERATURE] + ws[o + SUPPLY_LOSS]
        valid = valid and abs(ws[o + Q]) + 0.0 * (ws[o + QD] + ws[o + I] + meters) < LARGEST_ANGLE
    summary[VALID] = 1.0 if valid else 0.0
    if not valid:
        return False
    for a in range(n):
        o = U(a * STRIDE + lane)
        for row in range(3):
            out[row, a] = ws[o + U(row * W)]
        for row in range(5):
            out[3 + row, a] = ws[o + ELECTRICAL + U(row * W)]
        if TABLE or RUBBING or DRIVE:
            for row in range(SWITCHED_STATE_ROWS - STATE_ROWS):
                out[STATE_ROWS + row, a] = ws[o + CONTACT_LOSS + U(row * W)]
    end = U((n - 1) * STRIDE) + k
    s, c = sincos(ws[Q + k])
    summary[HAND] = ws[end + RHO] * c
    summary[HAND + 1] = ws[end + RHO] * s
    summary[HAND + 2] = ws[end + Z]
    summary[LOWEST] = ws[end + LOW]
    summary[BELOW_TABLE] += tail[BELOW + k]
    for j in range(elbows.size):
        summary[SUMMARY_COLUMNS + j] = tail[FORCES + U(j * W) + k]
    return True


def advance(state, parameters, voltage, elbows, first, end, n_steps, step, summary):
    """Arms first..end-1 of the batch, n_steps RK4 steps of `step` seconds under constant voltage, in place.

    state (B, STATE_ROWS, n), parameters (B, PARAMETER_ROWS, n), voltage (B, n), summary (B, SUMMARY_COLUMNS + p).
    With n_steps = 0 only the summary is refreshed. An arm whose state leaves the representable keeps its old
    state and summary, with VALID at zero. Returns the number of such arms.
    """
    invalid = 0
    n = state.shape[2]
    ws, tail = workspace(n)
    tip = U((n - 1) * STRIDE)
    for start in range(first, end, W):
        load(ws, n, start, state[:end], parameters, voltage)
        for k in range(LANES):
            tail[BELOW + k] = 0.0
        evaluate(ws, tail, n, elbows)
        for _ in range(n_steps):
            for k in range(LANES):
                tail[BELOW + k] += step if ws[tip + LOW + k] < -LOWEST_FREE else 0.0
            first_stage(ws, n, step / 6.0, step / 2.0)
            evaluate(ws, tail, n, elbows)
            middle_stage(ws, n, step / 3.0, step / 2.0)
            evaluate(ws, tail, n, elbows)
            middle_stage(ws, n, step / 3.0, step)
            evaluate(ws, tail, n, elbows)
            last_stage(ws, n, step / 6.0, step)
            project(ws, tail, elbows)
            # Its summary is the end of this step, its accelerations the first stage of the next.
            evaluate(ws, tail, n, elbows)
        for lane in range(min(W, end - start)):
            if not unload(ws, tail, n, lane, elbows, state[start + lane], summary[start + lane]):
                invalid += 1
    return invalid


def accelerations(state, parameters, voltage, elbows, q_ddot, current_dot, elbow_force):
    """Right-hand side of eq. 17 at each arm's state: q_ddot and current_dot (B, n), elbow_force (B, p)."""
    n = state.shape[2]
    ws, tail = workspace(n)
    for start in range(0, state.shape[0], W):
        load(ws, n, start, state, parameters, voltage)
        evaluate(ws, tail, n, elbows)
        # The increments of a step of one second are the rates.
        first_stage(ws, n, 1.0, 0.0)
        for lane in range(min(W, state.shape[0] - start)):
            for a in range(n):
                q_ddot[start + lane, a] = ws[U(a * STRIDE + lane) + QDA]
                current_dot[start + lane, a] = ws[U(a * STRIDE + lane) + IA]
            for j in range(elbows.size):
                elbow_force[start + lane, j] = tail[FORCES + U(j * W + lane)]


def settle(q, parameters, elbows):
    """Moves poses q (B, n) onto the elbows' plane in place, as far as Newton's method gets."""
    n = q.shape[1]
    ws, tail = workspace(n)
    for start in range(0, q.shape[0], W):
        for lane in range(W):
            arm = min(start + lane, q.shape[0] - 1)
            for a in range(n):
                ws[U(a * STRIDE + lane) + Q] = q[arm, a]
                ws[U(a * STRIDE + lane) + LENGTH] = parameters[arm, 0, a]
        project(ws, tail, elbows)
        for lane in range(min(W, q.shape[0] - start)):
            for a in range(n):
                q[start + lane, a] = ws[U(a * STRIDE + lane) + Q]


class Kernel(NamedTuple):
    """The compiled entries for one lane count."""

    advance: Compiled
    accelerations: Compiled
    settle: Compiled


@cache
def kernel(lanes: int, *, table: bool = False, rubbing: bool = False, drive: bool = False) -> Kernel:
    """The entries for blocks of `lanes` arms (a divisor of W), compiled or taken from the cache.

    `table` is for a compliant table, `rubbing` for friction on rigid elbows, `drive` for gear friction, warm windings
    and a supply that sags. What is off is not compiled; with any on, state arrays have SWITCHED_STATE_ROWS.

    The functions above are templates: each kernel gets its own copy, whose globals are its own row offsets and switches
    and its own compiled callees. Closures would do the same, but Numba's disk cache never recognises a closure over
    compiled functions. Only the entries are cached; what they call is compiled into them.
    """
    space = dict(globals())
    space.update({name: type(space[name])(int(space[name]) * lanes // W) for name in SCALED})
    switched = table or rubbing or drive
    answers = lanes * (SLOTS + (SWITCHED_SLOTS if switched else 0))
    stride = answers + lanes * (MAXIMUM_ELBOWS * (2 if rubbing else 1) + 1)
    space.update(TABLE=table, RUBBING=rubbing, DRIVE=drive, LOWEST_FREE=CONTACT_TOLERANCE if table else LOWEST_FREE)
    space.update(Y=answers, X=answers + lanes * MAXIMUM_ELBOWS, STRIDE=stride, NEXT=U(stride))
    if not rubbing:
        space["TAIL"] = PLAIN_TAIL * lanes // W
    templates = (
        sincos, newton, project, contact, gear, outward, inward, solve, slide, couple, eliminate, hold, rub, brace,
        evaluate, joint, stage, first_stage, middle_stage, last_stage, workspace, load, unload, advance, accelerations,
        settle,
    )  # fmt: skip
    letters = "".join(letter for letter, on in zip("trd", (table, rubbing, drive), strict=True) if on)
    for template in templates:
        name = template.__name__
        copy = FunctionType(template.__code__, space, f"{name}_{lanes}{letters}")
        copy.__qualname__ = copy.__name__
        space[name] = _compiled(copy, cached=name in Kernel._fields, inlined=name in INLINED)
    made = Kernel(*(space[name] for name in Kernel._fields))
    _compile_now(made, SWITCHED_STATE_ROWS if switched else STATE_ROWS)
    return made


def _compile_now(made, rows):
    """Calls the entries that every run needs once, on an arm of nothing; says so when that takes a while."""
    elbows, one = np.array([3]), np.ones((1, 3))
    parameters = np.ones((1, PARAMETER_ROWS, 3))
    state, summary = np.ones((1, rows, 3)), np.zeros((1, SUMMARY_COLUMNS + 1))
    message = "elbow_gym: compiling its kernel for this machine, once; later starts take it from the cache"
    notice = Timer(PATIENCE, print, (message,), {"file": sys.stderr, "flush": True})
    notice.daemon = True
    notice.start()
    try:
        made.advance(state, parameters, one, elbows, 0, 1, 0, 0.001, summary)
        made.settle(one, parameters, elbows)
    finally:
        notice.cancel()

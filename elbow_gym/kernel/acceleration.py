"""Joint accelerations of a block, base to tip, and the powers that flow meanwhile."""

# pyright: basic

from elbow_gym.kernel.contact import gear_friction
from elbow_gym.kernel.slots import (
    ALPHA, AR, AZ, BUS, BUS_FLOOR, CONTACT_LOSS, COPPER, CURRENT, CURRENT0, D, DAMPING, DRAWN, DRIVE, ELECTRICAL, ER,
    EZ, FRICTION, GEAR, INVERSE_L, IR3, IZ3, KM, LANES, LOSS, MOTOR_DAMPING, NET, NEXT, PAYLOAD, PSI_DOT, Q_DDOT, Q_DOT,
    Q_DOT0, R, RHO, RHO_DOT, ROTOR, RUBBING, SAG, SHARE, SPIN, STRIDE, SUPPLY_LOSS, TABLE, TWIST, U, VOLTAGE, WORK,
    YAW_INERTIA, YAW_INERTIA_RATE,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template(inlined=True)
def meter(ws, here, k, weight):
    """Adds `weight` seconds of a joint's powers to its meters, and keeps its net voltage.

    Copper loss and link work take here what differs from them by the changes of L i^2 / 2 and of J q_dot^2 / 2 alone:
    R i^2 = v i - K_m i q_dot - (L i^2 / 2)_dot and tau q_dot = K_m i q_dot - D_m q_dot^2 - (J q_dot^2 / 2)_dot.
    `close_meters` takes those off at the end of a step. Products of a current and a rate suffer less from a current's
    transient than its square does.

    Reads: Q_DOT, CURRENT, ELECTRICAL, DRAWN, COPPER, FRICTION, WORK, VOLTAGE, KM, DAMPING, MOTOR_DAMPING, CONTACT_LOSS,
        LOSS, GEAR, SHARE.
    Writes: ELECTRICAL, DRAWN, COPPER, FRICTION, WORK, NET, CONTACT_LOSS.
    """
    q_dot = ws[here + Q_DOT + k]
    i = ws[here + CURRENT + k]
    v = ws[here + VOLTAGE + k]
    if DRIVE:
        v *= ws[here + SHARE + k]
    back_emf = ws[here + KM + k] * q_dot
    friction = ws[here + DAMPING + k] * q_dot
    gear_loss = ws[here + MOTOR_DAMPING + k] * q_dot
    if DRIVE:
        friction += ws[here + GEAR + k]
        gear_loss += ws[here + GEAR + k]
    power = v * i
    converted = back_emf * i
    ws[here + NET + k] = v - back_emf
    ws[here + ELECTRICAL + k] += weight * power
    ws[here + DRAWN + k] += weight * max(power, 0.0)
    ws[here + COPPER + k] += weight * (power - converted)
    ws[here + FRICTION + k] += weight * (friction * q_dot)
    ws[here + WORK + k] += weight * (converted - gear_loss * q_dot)
    if TABLE or RUBBING:
        ws[here + CONTACT_LOSS + k] += weight * ws[here + LOSS + k]


@template
def accelerate(ws, n, weight):
    """Accelerations of all joints, base to tip (the yaw stands alone), and `weight` seconds of powers on the meters.

    Reads: Q_DOT, CURRENT, ROTOR, KM, DAMPING, PAYLOAD, RHO, RHO_DOT, YAW_INERTIA, YAW_INERTIA_RATE, ER, EZ, D,
        SUPPLY_LOSS, SAG, BUS_FLOOR, TWIST, BUS, SHARE, IR3, IZ3, R, AR, AZ, ALPHA.
    Writes: Q_DDOT, SUPPLY_LOSS, SHARE, AR, AZ, ALPHA.
    """
    end = U((n - 1) * STRIDE)
    # A loop of its own: whether rows of the tip and of the base overlap shows only at run time, and with all rows of
    # `meter` in the loop LLVM gives up on testing for that and leaves it scalar.
    for k in range(LANES):
        payload = ws[end + PAYLOAD + k]
        rho = ws[end + RHO + k]
        inertia = ws[end + YAW_INERTIA + k] + payload * rho * rho + ws[ROTOR + k]
        rate = ws[end + YAW_INERTIA_RATE + k] + 2.0 * payload * rho * ws[end + RHO_DOT + k]
        u = ws[KM + k] * ws[CURRENT + k] - ws[DAMPING + k] * ws[Q_DOT + k]
        if TABLE or RUBBING:
            u += ws[end + TWIST + k]
        if DRIVE:
            u -= gear_friction(ws, U(0), k)
            drawn = max(ws[end + BUS + k], ws[BUS_FLOOR + k])
            ws[SHARE + k] = 1.0 - ws[SAG + k] * drawn
            ws[SUPPLY_LOSS + k] += weight * (ws[SAG + k] * drawn * drawn)
        ws[Q_DDOT + k] = (u - rate * ws[Q_DOT + k]) / inertia
    for k in range(LANES):
        meter(ws, U(0), k, weight)
    for a in range(1, n):
        here = U(a * STRIDE)
        parent = here - NEXT
        for k in range(LANES):
            if DRIVE:
                ws[here + SHARE + k] = ws[parent + SHARE + k]
            ar = ws[parent + AR + k]
            az = ws[parent + AZ + k]
            before = ws[parent + ALPHA + k]
            reaction = ws[here + IR3 + k] * ar + ws[here + IZ3 + k] * az
            alpha = ws[here + D + k] * ((ws[here + R + k] + ws[here + ROTOR + k] * before) - reaction)
            ws[here + ALPHA + k] = alpha
            ws[here + AR + k] = ar + ws[here + ER + k] * alpha
            ws[here + AZ + k] = az + ws[here + EZ + k] * alpha
            ws[here + Q_DDOT + k] = alpha - before
            meter(ws, here, k, weight)


@template(inlined=True)
def close_meters(ws, here, k):
    """Takes off a joint's meters what the step has stored in the inductance and in the rotor.

    Reads: Q_DOT, CURRENT, Q_DOT0, CURRENT0, COPPER, WORK, ROTOR, INVERSE_L.
    Writes: COPPER, WORK.
    """
    i = ws[here + CURRENT + k]
    i0 = ws[here + CURRENT0 + k]
    q_dot = ws[here + Q_DOT + k]
    q_dot0 = ws[here + Q_DOT0 + k]
    ws[here + COPPER + k] -= 0.5 / ws[here + INVERSE_L + k] * (i * i - i0 * i0)
    ws[here + WORK + k] -= 0.5 * ws[here + ROTOR + k] * (q_dot * q_dot - q_dot0 * q_dot0)


@template(inlined=True)
def turn_plane(ws):
    """Hands a new yaw rate on to the outward pass.

    Reads: Q_DOT.
    Writes: SPIN, PSI_DOT.
    """
    for k in range(LANES):
        ws[SPIN + k] = ws[Q_DOT + k] * ws[Q_DOT + k]
        if TABLE:
            ws[PSI_DOT + k] = ws[Q_DOT + k]

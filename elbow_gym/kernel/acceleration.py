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
def meter(ws, here, weight):
    """Adds `weight` seconds of a joint's powers to its meters, and keeps its net voltage.

    Copper loss and link work take here what differs from them by the changes of L i^2 / 2 and of J q_dot^2 / 2 alone:
    R i^2 = v i - K_m i q_dot - (L i^2 / 2)_dot and tau q_dot = K_m i q_dot - D_m q_dot^2 - (J q_dot^2 / 2)_dot.
    `close_meters` takes those off at the end of a step. Products of a current and a rate suffer less from a current's
    transient than its square does.

    Reads: Q_DOT, CURRENT, ELECTRICAL, DRAWN, COPPER, FRICTION, WORK, VOLTAGE, KM, DAMPING, MOTOR_DAMPING, CONTACT_LOSS,
        LOSS, GEAR, SHARE.
    Writes: ELECTRICAL, DRAWN, COPPER, FRICTION, WORK, NET, CONTACT_LOSS.
    """
    q_dot = ws[here + Q_DOT]
    i = ws[here + CURRENT]
    v = ws[here + VOLTAGE]
    if DRIVE:
        v *= ws[here + SHARE]
    back_emf = ws[here + KM] * q_dot
    friction = ws[here + DAMPING] * q_dot
    gear_loss = ws[here + MOTOR_DAMPING] * q_dot
    if DRIVE:
        friction += ws[here + GEAR]
        gear_loss += ws[here + GEAR]
    power = v * i
    converted = back_emf * i
    ws[here + NET] = v - back_emf
    ws[here + ELECTRICAL] += weight * power
    ws[here + DRAWN] += weight * max(power, 0.0)
    ws[here + COPPER] += weight * (power - converted)
    ws[here + FRICTION] += weight * (friction * q_dot)
    ws[here + WORK] += weight * (converted - gear_loss * q_dot)
    if TABLE or RUBBING:
        ws[here + CONTACT_LOSS] += weight * ws[here + LOSS]


@template
def accelerate(ws, n, weight):
    """Accelerations of all joints, base to tip (the yaw stands alone), and `weight` seconds of powers on the meters.

    Reads: Q_DOT, CURRENT, ROTOR, KM, DAMPING, PAYLOAD, RHO, RHO_DOT, YAW_INERTIA, YAW_INERTIA_RATE, ER, EZ, D,
        SUPPLY_LOSS, SAG, BUS_FLOOR, TWIST, BUS, SHARE, IR3, IZ3, R, AR, AZ, ALPHA.
    Writes: Q_DDOT, SUPPLY_LOSS, SHARE, AR, AZ, ALPHA.
    """
    tip = U((n - 1) * STRIDE)
    # A loop of its own: whether rows of the tip and of the base overlap shows only at run time, and with all rows of
    # `meter` in the loop LLVM gives up on testing for that and leaves it scalar.
    for k in range(LANES):
        end = tip + k
        payload = ws[end + PAYLOAD]
        rho = ws[end + RHO]
        inertia = ws[end + YAW_INERTIA] + payload * rho * rho + ws[ROTOR + k]
        rate = ws[end + YAW_INERTIA_RATE] + 2.0 * payload * rho * ws[end + RHO_DOT]
        u = ws[KM + k] * ws[CURRENT + k] - ws[DAMPING + k] * ws[Q_DOT + k]
        if TABLE or RUBBING:
            u += ws[end + TWIST]
        if DRIVE:
            u -= gear_friction(ws, k)
            drawn = max(ws[end + BUS], ws[BUS_FLOOR + k])
            ws[SHARE + k] = 1.0 - ws[SAG + k] * drawn
            ws[SUPPLY_LOSS + k] += weight * (ws[SAG + k] * drawn * drawn)
        ws[Q_DDOT + k] = (u - rate * ws[Q_DOT + k]) / inertia
    for k in range(LANES):
        meter(ws, k, weight)
    for a in range(1, n):
        record = U(a * STRIDE)
        for k in range(LANES):
            here = record + k
            parent = here - NEXT
            if DRIVE:
                ws[here + SHARE] = ws[parent + SHARE]
            ar = ws[parent + AR]
            az = ws[parent + AZ]
            before = ws[parent + ALPHA]
            reaction = ws[here + IR3] * ar + ws[here + IZ3] * az
            alpha = ws[here + D] * ((ws[here + R] + ws[here + ROTOR] * before) - reaction)
            ws[here + ALPHA] = alpha
            ws[here + AR] = ar + ws[here + ER] * alpha
            ws[here + AZ] = az + ws[here + EZ] * alpha
            ws[here + Q_DDOT] = alpha - before
            meter(ws, here, weight)


@template(flat=True)
def close_meters(ws, here):
    """Takes off a joint's meters what the step has stored in the inductance and in the rotor.

    Reads: Q_DOT, CURRENT, Q_DOT0, CURRENT0, COPPER, WORK, ROTOR, INVERSE_L.
    Writes: COPPER, WORK.
    """
    i = ws[here + CURRENT]
    i0 = ws[here + CURRENT0]
    q_dot = ws[here + Q_DOT]
    q_dot0 = ws[here + Q_DOT0]
    ws[here + COPPER] -= 0.5 / ws[here + INVERSE_L] * (i * i - i0 * i0)
    ws[here + WORK] -= 0.5 * ws[here + ROTOR] * (q_dot * q_dot - q_dot0 * q_dot0)


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

"""Runge-Kutta stage of one joint: its share of the step, the energies alongside, and the state of the next stage."""

# pyright: basic

from elbow_gym.kernel.slots import (
    CONTACT_LOSS, COOLING, COPPER, CURRENT, CURRENT0, CURRENT_SUM, DAMPING, DRAWN, DRIVE, ELECTRICAL, FRICTION, GEAR,
    HEATING, INVERSE_L, KM, LOSS, MOTOR_DAMPING, Q, Q0, Q_DOT, Q_DOT0, Q_DOT_SUM, RESISTANCE, ROTOR, RUBBING, SHARE,
    TABLE, TEMPERATURE, TEMPERATURE0, TEMPERATURE_SUM, VOLTAGE, WARMING, WORK,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template(inlined=True)
def rk4_joint(ws, here, k, q_ddot, weight, ahead, first, last):
    """Adds one RK4 stage of a joint to the step's increments and meters, and sets its next state.

    `weight` is the stage's share of the step [s], `ahead` how far off the next stage is, in the last one the step.

    Reads: Q, Q_DOT, CURRENT, Q0, Q_DOT0, CURRENT0, Q_DOT_SUM, CURRENT_SUM, ELECTRICAL, DRAWN, COPPER, FRICTION, WORK,
        VOLTAGE, ROTOR, KM, DAMPING, MOTOR_DAMPING, RESISTANCE, INVERSE_L, CONTACT_LOSS, TEMPERATURE, HEATING, COOLING,
        WARMING, LOSS, GEAR, SHARE, TEMPERATURE0, TEMPERATURE_SUM.
    Writes: Q, Q_DOT, CURRENT, Q0, Q_DOT0, CURRENT0, Q_DOT_SUM, CURRENT_SUM, ELECTRICAL, DRAWN, COPPER, FRICTION, WORK,
        CONTACT_LOSS, TEMPERATURE, TEMPERATURE0, TEMPERATURE_SUM.
    """
    q = ws[here + Q + k] if first else ws[here + Q0 + k]
    q_dot = ws[here + Q_DOT + k]
    i = ws[here + CURRENT + k]
    qd = q_dot if first else ws[here + Q_DOT0 + k]
    i0 = i if first else ws[here + CURRENT0 + k]
    v = ws[here + VOLTAGE + k]
    resistance = ws[here + RESISTANCE + k]
    if DRIVE:
        v *= ws[here + SHARE + k]
        warmth = ws[here + TEMPERATURE + k]
        resistance *= 1.0 + ws[here + WARMING + k] * warmth
        warmth0 = warmth if first else ws[here + TEMPERATURE0 + k]
        warmer = weight * (ws[here + HEATING + k] * (resistance * i * i) - ws[here + COOLING + k] * warmth)
        heat = ahead * (ws[here + HEATING + k] * (resistance * i * i) - ws[here + COOLING + k] * warmth)
        if first:
            ws[here + TEMPERATURE0 + k] = warmth0
        else:
            warmer += ws[here + TEMPERATURE_SUM + k]
        ws[here + TEMPERATURE_SUM + k] = warmer
        ws[here + TEMPERATURE + k] = warmth0 + (warmer if last else heat)
    km = ws[here + KM + k]
    i_dot = (v - resistance * i - km * q_dot) * ws[here + INVERSE_L + k]
    power = v * i
    torque = km * i - ws[here + ROTOR + k] * q_ddot - ws[here + MOTOR_DAMPING + k] * q_dot
    ws[here + ELECTRICAL + k] += weight * power
    ws[here + DRAWN + k] += weight * max(power, 0.0)
    ws[here + COPPER + k] += weight * (resistance * i * i)
    friction = ws[here + DAMPING + k] * q_dot * q_dot
    if DRIVE:
        torque -= ws[here + GEAR + k]
        friction += ws[here + GEAR + k] * q_dot
    if TABLE or RUBBING:
        ws[here + CONTACT_LOSS + k] += weight * ws[here + LOSS + k]
    ws[here + FRICTION + k] += weight * friction
    ws[here + WORK + k] += weight * (torque * q_dot)
    qda = weight * q_ddot
    ia = weight * i_dot
    if first:
        ws[here + Q0 + k] = q
        ws[here + Q_DOT0 + k] = qd
        ws[here + CURRENT0 + k] = i0
    else:
        qda += ws[here + Q_DOT_SUM + k]
        ia += ws[here + CURRENT_SUM + k]
    if last:
        # The angle's own increment, out of what the stages left behind: one row less to keep.
        shift = ahead * qd
        ws[here + Q + k] = (
            q
            + (shift + ahead * ws[here + Q_DOT_SUM + k])
            - (ws[here + Q + k] - q - shift) * (1.0 / 3.0)
            - weight * (q_dot - qd)
        )
        ws[here + Q_DOT + k] = qd + qda
        ws[here + CURRENT + k] = i0 + ia
    else:
        ws[here + Q_DOT_SUM + k] = qda
        ws[here + CURRENT_SUM + k] = ia
        ws[here + Q + k] = q + ahead * q_dot
        ws[here + Q_DOT + k] = qd + ahead * q_ddot
        ws[here + CURRENT + k] = i0 + ahead * i_dot

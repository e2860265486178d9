"""Stages of the classical Runge-Kutta method: what each adds to the step, and the state of the next one."""

# pyright: basic

from elbow_gym.kernel.acceleration import close_meters, turn_plane
from elbow_gym.kernel.slots import (
    CURRENT, CURRENT0, CURRENT_SUM, DRIVE, INVERSE_L, LANES, NET, Q, Q0, Q_DDOT, Q_DOT, Q_DOT0, Q_DOT_SUM, RESISTANCE,
    STRIDE, U,
)  # fmt: skip
from elbow_gym.kernel.template import template
from elbow_gym.kernel.winding import warm


@template(inlined=True)
def rk4_stage(ws, n, weight, ahead, number):
    """Adds stage `number`, 1 to 4, with `weight` [s] of the step, and sets the state `ahead` [s] of its start.

    The last one sets the step's end.

    Reads: Q, Q_DOT, CURRENT, Q0, Q_DOT0, CURRENT0, Q_DOT_SUM, CURRENT_SUM, RESISTANCE, INVERSE_L, Q_DDOT, NET.
    Writes: Q, Q_DOT, CURRENT, Q0, Q_DOT0, CURRENT0, Q_DOT_SUM, CURRENT_SUM.
    """
    for a in range(n):
        record = U(a * STRIDE)
        for k in range(LANES):
            here = record + k
            q_dot = ws[here + Q_DOT]
            i = ws[here + CURRENT]
            q0 = ws[here + Q] if number == 1 else ws[here + Q0]
            q_dot0 = q_dot if number == 1 else ws[here + Q_DOT0]
            i0 = i if number == 1 else ws[here + CURRENT0]
            resistance = ws[here + RESISTANCE]
            if DRIVE:
                resistance = warm(ws, here, weight, ahead, number)
            q_ddot = ws[here + Q_DDOT]
            i_dot = (ws[here + NET] - resistance * i) * ws[here + INVERSE_L]
            kicked = weight * q_ddot
            charged = weight * i_dot
            if number == 1:
                ws[here + Q0] = q0
                ws[here + Q_DOT0] = q_dot0
                ws[here + CURRENT0] = i0
            else:
                kicked += ws[here + Q_DOT_SUM]
                charged += ws[here + CURRENT_SUM]
            if number == 4:
                # The angle's own increment, out of what the stages left behind: one row less to keep.
                shift = ahead * q_dot0
                turned = (shift + ahead * ws[here + Q_DOT_SUM]) - (ws[here + Q] - q0 - shift) * (1.0 / 3.0)
                ws[here + Q] = q0 + (turned - weight * (q_dot - q_dot0))
                ws[here + Q_DOT] = q_dot0 + kicked
                ws[here + CURRENT] = i0 + charged
                close_meters(ws, here)
            else:
                ws[here + Q_DOT_SUM] = kicked
                ws[here + CURRENT_SUM] = charged
                ws[here + Q] = q0 + ahead * q_dot
                ws[here + Q_DOT] = q_dot0 + ahead * q_ddot
                ws[here + CURRENT] = i0 + ahead * i_dot
    turn_plane(ws)


@template
def rk4_first(ws, n, step):
    """Stage 1, which keeps the state that the step starts from."""
    rk4_stage(ws, n, step / 6.0, step / 2.0, 1)


@template
def rk4_second(ws, n, step):
    """Stage 2, at half a step."""
    rk4_stage(ws, n, step / 3.0, step / 2.0, 2)


@template
def rk4_third(ws, n, step):
    """Stage 3, at half a step; the next one is at its end."""
    rk4_stage(ws, n, step / 3.0, step, 3)


@template
def rk4_fourth(ws, n, step):
    """Stage 4, whose next state is the step's end."""
    rk4_stage(ws, n, step / 6.0, step, 4)

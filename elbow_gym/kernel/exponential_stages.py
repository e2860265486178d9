"""Stages of an exponential Runge-Kutta method: the currents' own decay is exact, all else is classical.

L i_dot = N - R i with the net voltage N = v - K_m q_dot decays at R / L, faster than anything else in a free arm. Over
a step h let N be the parabola through its values N_0, N_m, N_1 at the start, the middle and the end. With z = h R / L
and

    phi_0 = e^-z,   phi_k = (1/(k-1)! - phi_(k-1)) / z,

that gives the current at the end and its mean over the step exactly,

    i_1  = phi_0 i_0 + h/L [phi_1 N_0 + phi_2 (-3 N_0 + 4 N_m - N_1) + 2 phi_3 (2 N_0 - 4 N_m + 2 N_1)]
    mean = phi_1 i_0 + h/L [phi_2 N_0 + phi_3 (-3 N_0 + 4 N_m - N_1) + 2 phi_4 (2 N_0 - 4 N_m + 2 N_1)]

and, after half a step of constant N, i = e^(-z/2) i_0 + h/2L phi_1(z/2) N. Angles and rates take the classical stages,
whose last current is set so that Simpson's mean of the four is the mean above: the motion then gets the impulse of the
current's transient right, however short it is. That current differs from the solution by O(h^4) and counts with h/6,
so the step stays of order 4.

Energies take Simpson's sum of the stages, which the mean current makes exact for v i under a constant voltage. The four
stages are one method, so they are one file.
"""

# pyright: basic

from elbow_gym.kernel.acceleration import close_meters, turn_plane
from elbow_gym.kernel.slots import (
    CURRENT, CURRENT0, CURRENT_SUM, DECAY, DRIVE, END_0, END_1, END_MID, HALF_DECAY, HALF_GAIN, KM, LANES, MEAN_0,
    MEAN_1, MEAN_DECAY, MEAN_MID, NET, NET_0, NET_MID, Q, Q0, Q_DDOT, Q_DOT, Q_DOT0, Q_DOT_SUM, START_R, STRIDE, U,
)  # fmt: skip
from elbow_gym.kernel.template import template
from elbow_gym.kernel.winding import warm


@template
def exponential_first(ws, n, step):
    """Stage 1, which keeps the state that the step starts from.

    Reads: Q, Q_DOT, CURRENT, Q_DDOT, NET, HALF_DECAY, HALF_GAIN.
    Writes: Q, Q_DOT, CURRENT, Q0, Q_DOT0, CURRENT0, Q_DOT_SUM, NET_0.
    """
    half = step / 2.0
    for a in range(n):
        record = U(a * STRIDE)
        for k in range(LANES):
            here = record + k
            net = ws[here + NET]
            if DRIVE:
                net -= heated(ws, here, step / 6.0, half, 1)
            q_dot = ws[here + Q_DOT]
            i = ws[here + CURRENT]
            q_ddot = ws[here + Q_DDOT]
            ws[here + Q0] = ws[here + Q]
            ws[here + Q_DOT0] = q_dot
            ws[here + CURRENT0] = i
            ws[here + NET_0] = net
            ws[here + Q_DOT_SUM] = step / 6.0 * q_ddot
            ws[here + Q] += half * q_dot
            ws[here + Q_DOT] = q_dot + half * q_ddot
            ws[here + CURRENT] = ws[here + HALF_DECAY] * i + ws[here + HALF_GAIN] * net
    turn_plane(ws)


@template
def exponential_second(ws, n, step):
    """Stage 2, at half a step.

    Reads: Q_DOT, CURRENT, Q0, Q_DOT0, CURRENT0, Q_DOT_SUM, Q_DDOT, NET, HALF_DECAY, HALF_GAIN.
    Writes: Q, Q_DOT, CURRENT, Q_DOT_SUM, CURRENT_SUM, NET_MID.
    """
    half = step / 2.0
    for a in range(n):
        record = U(a * STRIDE)
        for k in range(LANES):
            here = record + k
            net = ws[here + NET]
            if DRIVE:
                net -= heated(ws, here, step / 3.0, half, 2)
            q_ddot = ws[here + Q_DDOT]
            ws[here + NET_MID] = net
            ws[here + CURRENT_SUM] = ws[here + CURRENT]
            ws[here + Q_DOT_SUM] += step / 3.0 * q_ddot
            ws[here + Q] = ws[here + Q0] + half * ws[here + Q_DOT]
            ws[here + Q_DOT] = ws[here + Q_DOT0] + half * q_ddot
            ws[here + CURRENT] = ws[here + HALF_DECAY] * ws[here + CURRENT0] + ws[here + HALF_GAIN] * net
    turn_plane(ws)


@template
def exponential_third(ws, n, step):
    """Stage 3, at half a step; the next one is at its end, with the current that makes Simpson's mean the true one.

    Reads: Q_DOT, CURRENT, Q0, Q_DOT0, CURRENT0, Q_DOT_SUM, CURRENT_SUM, KM, Q_DDOT, NET, MEAN_DECAY, MEAN_0,
        MEAN_MID, MEAN_1, NET_0, NET_MID.
    Writes: Q, Q_DOT, CURRENT, Q_DOT_SUM, NET_MID.
    """
    for a in range(n):
        record = U(a * STRIDE)
        for k in range(LANES):
            here = record + k
            net = ws[here + NET]
            if DRIVE:
                net -= heated(ws, here, step / 3.0, step, 3)
            q_dot = ws[here + Q_DOT]
            q_ddot = ws[here + Q_DDOT]
            i0 = ws[here + CURRENT0]
            middle = 0.5 * (ws[here + NET_MID] + net)
            late = ws[here + Q_DOT0] + step * q_ddot
            mean = ws[here + MEAN_DECAY] * i0 + (
                (ws[here + MEAN_0] * ws[here + NET_0] + ws[here + MEAN_MID] * middle)
                + ws[here + MEAN_1] * (net + ws[here + KM] * (q_dot - late))
            )
            ws[here + NET_MID] = middle
            ws[here + Q_DOT_SUM] += step / 3.0 * q_ddot
            ws[here + Q] = ws[here + Q0] + step * q_dot
            ws[here + Q_DOT] = late
            ws[here + CURRENT] = 6.0 * mean - i0 - 2.0 * (ws[here + CURRENT_SUM] + ws[here + CURRENT])
    turn_plane(ws)


@template
def exponential_fourth(ws, n, step):
    """Stage 4, whose next state is the step's end.

    Reads: Q, Q_DOT, Q0, Q_DOT0, CURRENT0, Q_DOT_SUM, Q_DDOT, NET, DECAY, END_0, END_MID, END_1, NET_0,
        NET_MID.
    Writes: Q, Q_DOT, CURRENT.
    """
    for a in range(n):
        record = U(a * STRIDE)
        for k in range(LANES):
            here = record + k
            net = ws[here + NET]
            if DRIVE:
                net -= heated(ws, here, step / 6.0, step, 4)
            q_dot = ws[here + Q_DOT]
            q0 = ws[here + Q0]
            q_dot0 = ws[here + Q_DOT0]
            gained = ws[here + Q_DOT_SUM]
            end = q_dot0 + (gained + step / 6.0 * ws[here + Q_DDOT])
            # The angle's own increment, out of what the stages left behind: one row less to keep.
            shift = step * q_dot0
            turned = (shift + step * gained) - (ws[here + Q] - q0 - shift) * (1.0 / 3.0)
            ws[here + Q] = q0 + (turned - step / 6.0 * (q_dot - q_dot0))
            ws[here + Q_DOT] = end
            ws[here + CURRENT] = ws[here + DECAY] * ws[here + CURRENT0] + (
                (ws[here + END_0] * ws[here + NET_0] + ws[here + END_MID] * ws[here + NET_MID]) + ws[here + END_1] * net
            )
            close_meters(ws, here)
    turn_plane(ws)


@template(inlined=True)
def heated(ws, here, weight, ahead, number):
    """Voltage that a winding has come to take in stage `number`, 1 to 4, by its warming since the step's start [V].

    The step's coefficients know the resistance at its start, so that the rest counts as a voltage.

    Reads: CURRENT, START_R.
    """
    return (warm(ws, here, weight, ahead, number) - ws[here + START_R]) * ws[here + CURRENT]

"""Classical Runge-Kutta step of a block: four evaluations and stages, then the pose back onto the elbows' plane."""

# pyright: basic

from elbow_gym.kernel.elbows import elbow_forces
from elbow_gym.kernel.contact import gear_friction
from elbow_gym.kernel.rk4_joint import rk4_joint
from elbow_gym.kernel.projection import project
from elbow_gym.kernel.recursion import inward, outward
from elbow_gym.kernel.slots import (
    ALPHA, AR, AZ, BELOW, BUS, BUS_FLOOR, CURRENT, D, DAMPING, DRIVE, ER, EZ, IR3, IZ3, KM, LANES, LOWEST_FREE,
    LOWEST_Z, NEXT, PAYLOAD, PSI_DOT, Q_DOT, R, RHO, RHO_DOT, ROTOR, RUBBING, SAG, SHARE, SPIN, STRIDE, SUPPLY_LOSS,
    TABLE, TWIST, U, YAW_INERTIA, YAW_INERTIA_RATE,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template(inlined=True)
def stage(ws, n, weight, ahead, first, last):
    """Joint accelerations, base to tip (the yaw stands alone), and what the stage makes of them.

    Reads: Q_DOT, CURRENT, ROTOR, KM, DAMPING, PAYLOAD, RHO, RHO_DOT, YAW_INERTIA, YAW_INERTIA_RATE, ER, EZ, D,
        SUPPLY_LOSS, SAG, BUS_FLOOR, TWIST, BUS, SHARE, IR3, IZ3, R, AR, AZ, ALPHA.
    Writes: SPIN, SUPPLY_LOSS, PSI_DOT, SHARE, R, AR, AZ, ALPHA.
    """
    end = U((n - 1) * STRIDE)
    # A loop of its own: whether rows of the tip and of the base overlap shows only at run time, and with all rows of
    # `rk4_joint` in the loop LLVM gives up on testing for that and leaves it scalar.
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
        ws[R + k] = (u - rate * ws[Q_DOT + k]) / inertia
    for k in range(LANES):
        rk4_joint(ws, U(0), k, ws[R + k], weight, ahead, first, last)
        ws[SPIN + k] = ws[Q_DOT + k] * ws[Q_DOT + k]
        if TABLE:
            ws[PSI_DOT + k] = ws[Q_DOT + k]
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
            rk4_joint(ws, here, k, alpha - before, weight, ahead, first, last)


@template
def first_stage(ws, n, weight, ahead):
    """Stage 1, which keeps the state that the step starts from."""
    stage(ws, n, weight, ahead, True, False)


@template
def middle_stage(ws, n, weight, ahead):
    """Stages 2 and 3."""
    stage(ws, n, weight, ahead, False, False)


@template
def last_stage(ws, n, weight, ahead):
    """Stage 4, whose next state is the step's end."""
    stage(ws, n, weight, ahead, False, True)


@template
def evaluate(ws, shared, n, elbows):
    """All that the joint accelerations are made of, at the current stage's state."""
    outward(ws, n)
    inward(ws, n)
    elbow_forces(ws, shared, n, elbows)


@template(inlined=True)
def rk4_step(ws, shared, n, tip, elbows, step):
    """Advances a block by `step` [s] under constant voltage, from an evaluated state to an evaluated state.

    With k_1 the slope at the start, k_2 at half a step along k_1, k_3 at half a step along k_2 and k_4 at a step along
    k_3, the state moves by h/6 k_1 + h/3 k_2 + h/3 k_3 + h/6 k_4. A stage adds its share of that sum, then sets the
    state of the next one.

    Reads: LOWEST_Z, BELOW.
    Writes: BELOW.
    """
    for k in range(LANES):
        shared[BELOW + k] += step if ws[tip + LOWEST_Z + k] < -LOWEST_FREE else 0.0
    first_stage(ws, n, step / 6.0, step / 2.0)  # k_1
    evaluate(ws, shared, n, elbows)
    middle_stage(ws, n, step / 3.0, step / 2.0)  # k_2
    evaluate(ws, shared, n, elbows)
    middle_stage(ws, n, step / 3.0, step)  # k_3
    evaluate(ws, shared, n, elbows)
    last_stage(ws, n, step / 6.0, step)  # k_4
    project(ws, shared, elbows)
    # The summary of the end of this step, and k_1 of the next.
    evaluate(ws, shared, n, elbows)

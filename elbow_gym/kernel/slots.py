"""Workspace of a block of arms: the row of every quantity that a pass keeps, with its meaning and unit.

A block is W arms side by side in one flat float64 array of records. Record a holds joint a + 1 and its link, record n
the tip. A slot is one row of W lanes in a record, so that entry (record a, slot S, lane k) has the index
a * STRIDE + S + k. What belongs to a whole arm instead of a joint is in `shared`, a second array of rows of W lanes.

Offsets are counted in lanes: `offsets` derives them for another lane count and other switches. One line is one
quantity, so this file is one table.
"""

from typing import Any

import numpy as np

from elbow_gym.kernel.rows import BELOW_TABLE_TOLERANCE, CONTACT_TOLERANCE, MAXIMUM_ELBOWS

U = np.uint64
BLOCK_LANES = 16
W = BLOCK_LANES  # length of a row
LANES = U(W)
# What a kernel is made for: a compliant table, friction on rigid elbows, motors with more than the paper's losses.
TABLE, RUBBING, DRIVE = False, False, False
# Whether the currents' own decay is exact, or takes the classical stages as all else does.
EXPONENTIAL = False
LOWEST_FREE = BELOW_TABLE_TOLERANCE

MEANINGS: list[str] = []
"""Meaning of each row of a record, in the order of the rows."""


def slot(meaning: str) -> np.uint64:
    """Offset of the next free row of a record."""
    MEANINGS.append(meaning)
    return U(W * (len(MEANINGS) - 1))


# State and meters, in the order of rows.STATE.
Q = slot("relative joint angle q [rad]")
Q_DOT = slot("relative joint velocity [rad/s]")
CURRENT = slot("armature current i [A]")
ELECTRICAL = slot("electrical energy, integral of v i [J]")
DRAWN = slot("drawn energy, integral of max(v i, 0) [J]")
COPPER = slot("copper loss, integral of R i^2 [J]")
FRICTION = slot("friction loss of joint and gear [J]")
WORK = slot("link work, integral of tau q_dot [J]")
Q0 = slot("q at the start of the step [rad]")
Q_DOT0 = slot("q_dot at the start of the step [rad/s]")
CURRENT0 = slot("i at the start of the step [A]")
Q_DOT_SUM = slot("weighted sum of the stages' q_ddot so far [rad/s]")
CURRENT_SUM = slot("RK4: weighted sum of the stages' i_dot so far; exponential: i of stage 2 [A]")
VOLTAGE = slot("terminal voltage v [V]")
# Parameters, in the order of rows.PARAMETERS.
LENGTH = slot("link length l [m]")
MASS = slot("link mass m [kg]")
END_INERTIA = slot("transverse inertia about the joint, I_t + m l^2 / 4 [kg m^2]")
DIFFERENCE = slot("I_t - I_s [kg m^2]")
AXIAL = slot("axial inertia I_s [kg m^2]")
ROTOR = slot("reflected rotor inertia J [kg m^2]")
KM = slot("joint torque constant K_m [N m/A]")
DAMPING = slot("viscous friction D + D_m [N m s/rad]")
MOTOR_DAMPING = slot("reflected viscous friction of the gear D_m [N m s/rad]")
RESISTANCE = slot("armature resistance R [ohm]")
INVERSE_L = slot("inverse armature inductance 1 / L [1/H]")
GRAVITY = slot("gravity g [m/s^2]")
PAYLOAD = slot("mass at the hand [kg]")
# Of the outward pass, base to tip. Positions and rates are those of the link's end.
PHI = slot("absolute pitch phi [rad]")
OMEGA = slot("absolute pitch rate w [rad/s]")
SPIN = slot("yaw rate squared, psi_dot^2 [rad^2/s^2]")
RHO = slot("radius rho [m]")
RHO_DOT = slot("rate of the radius [m/s]")
SUMR = slot("radial acceleration of the pitch rates alone [m/s^2]")
SUMZ = slot("vertical acceleration of the pitch rates alone [m/s^2]")
Z = slot("height z [m]")
YAW_INERTIA = slot("inertia about the yaw axis of the links so far [kg m^2]")
YAW_INERTIA_RATE = slot("rate of that inertia [kg m^2/s]")
LOWEST_Z = slot("least height of the links' ends so far [m]")
ER = slot("radial part of e', l cos phi [m]; in a projection l sin phi")
EZ = slot("vertical part of e', -l sin phi [m]")
FR = slot("radial inertial force of the link [N]")
FZ = slot("vertical inertial and gravity force of the link [N]")
TORQUE_BIAS = slot("bias torque of the link about its joint [N m]")
# Of the inward pass, tip to base.
D = slot("inverse articulated inertia d [1/(kg m^2)]")
KRR = slot("articulated inertia K, radial [kg]")
KRZ = slot("articulated inertia K, radial-vertical [kg]")
KZZ = slot("articulated inertia K, vertical [kg]")
BR = slot("articulated bias b, radial [N]")
BZ = slot("articulated bias b, vertical [N]")
B3 = slot("articulated bias b, torque [N m]")
# Of the elbow pass.
FREE = slot("vertical acceleration of the elbow without elbow forces, summed so far [m/s^2]")
GAIN = slot("vertical acceleration of the elbow for a newton on it, summed so far [1/kg]")
Q_DDOT = slot("relative joint acceleration [rad/s^2]")
NET = slot("net voltage N = v - K_m q_dot [V]")
# Of exponential steps: what the current is made of, and what the stages keep.
DECAY = slot("e^-z with z = h R / L [-]")
HALF_DECAY = slot("e^(-z/2) [-]")
HALF_GAIN = slot("current after half a step for a volt [A/V]")
END_0 = slot("current after the step for a volt at its start [A/V]")
END_MID = slot("current after the step for a volt at its middle [A/V]")
END_1 = slot("current after the step for a volt at its end [A/V]")
MEAN_DECAY = slot("mean current over the step for an ampere at its start [-]")
MEAN_0 = slot("mean current over the step for a volt at its start [A/V]")
MEAN_MID = slot("mean current over the step for a volt at its middle [A/V]")
MEAN_1 = slot("mean current over the step for a volt at its end [A/V]")
NET_0 = slot("net voltage N at the start of the step [V]")
NET_MID = slot("net voltage N at its middle, of the stages so far [V]")
SLOTS = len(MEANINGS)
# From here on only in kernels with a switch on; states and parameters first, in the order of rows.py.
CONTACT_LOSS = slot("energy lost in contacts [J]")
TEMPERATURE = slot("temperature rise of the winding [K]")
SUPPLY_LOSS = slot("energy lost in the supply [J], with joint 1")
CONTACT_R = slot("radial contact force [N]")
CONTACT_T = slot("tangential contact force [N]")
CONTACT_N = slot("normal contact force [N]")
STIFFNESS = slot("stiffness k of the table [N/m]")
DISSIPATION = slot("dissipation c of the table [s/m]")
TABLE_FRICTION = slot("friction coefficient mu of the table [-]")
FRICTION_SPEED = slot("speed v_s over which the table's friction comes up [m/s]")
ELBOW_FRICTION = slot("friction coefficient of rigid elbows [-]")
COULOMB = slot("Coulomb friction of the gear at the joint [N m]")
HEATING = slot("inverse thermal capacity 1 / C_th [K/J]")
COOLING = slot("inverse thermal time constant [1/s]")
WARMING = slot("temperature coefficient of the resistance [1/K]")
SAG = slot("supply resistance over the square of its voltage, R_s / V0^2 [1/W]")
BUS_FLOOR = slot("least power that the supply takes [W]")
PSI_DOT = slot("yaw rate [rad/s]")
Z_DOT = slot("vertical velocity of the link's end [m/s]")
TWIST = slot("torque of contacts about the yaw axis, summed so far [N m]")
LOSS = slot("power lost in the contact [W]")
GEAR = slot("torque of the gear's Coulomb friction [N m]")
BUS = slot("power asked of the supply, summed so far [W]")
SHARE = slot("voltage of the supply over its nominal one [-]")
TEMPERATURE0 = slot("temperature rise at the start of the step [K]")
TEMPERATURE_SUM = slot("weighted sum of the stages' temperature rates so far [K]")
START_R = slot("armature resistance at the start of an exponential step [ohm]")
SWITCHED_SLOTS = len(MEANINGS) - SLOTS

# Quantities that take over the row of another, which no later pass reads.
REUSED = {
    "IR3": "FR", "IZ3": "FZ", "R": "TORQUE_BIAS",
    "AR": "KRR", "AZ": "KRZ", "ALPHA": "KZZ",
    "CR": "KRR", "CZ": "KRZ", "C3": "KZZ",
    "HEIGHT": "B3", "RATE": "BR", "GRAM": "BZ",
}  # fmt: skip
# Inward: coupling I_f3 of the link's force and pitch [kg m] and the joint's torque r that is left to move it [N m].
IR3, IZ3, R = FR, FZ, TORQUE_BIAS
# RK4 stage: acceleration of the link's end [m/s^2] and of its pitch [rad/s^2].
AR, AZ, ALPHA = KRR, KRZ, KZZ
# Elbow pass: bias of a unit force at an elbow, b = (CR, CZ, C3).
CR, CZ, C3 = KRR, KRZ, KZZ
# Projection: height [m] of a segment's end, its rate [m/s], squared lever arms [m^2]; later what shifts the links.
HEIGHT, RATE, GRAM = B3, BR, BZ

# Behind a record's slots: y, the answer of every joint to a unit +z force at each elbow, and x, that to its friction.
Y = W * SLOTS
X = Y + W * MAXIMUM_ELBOWS
# One row more, so that a slot of neighbouring records does not fall on the same cache lines.
STRIDE = W * (SLOTS + MAXIMUM_ELBOWS + 1)
NEXT = U(STRIDE)

# Rows of `shared`. The elbows' matrix W [1/kg] comes first, one row an entry, then:
_MATRIX = MAXIMUM_ELBOWS * MAXIMUM_ELBOWS
FORCES = U(W * _MATRIX)  # elbow forces [N]
BELOW = U(W * (_MATRIX + MAXIMUM_ELBOWS))  # time below the table [s]
SHIFT = BELOW + U(W)  # largest shift of a projection step [rad/m]
ACTIVE = SHIFT + U(W)  # 1 while the projection goes on
DRIFT = ACTIVE + U(W)  # largest vertical speed of an elbow after a step, which the projection takes [m/s]
ASTRAY = DRIFT + U(W)  # largest vertical acceleration of an elbow that its force or its step left [m/s^2]
PLAIN_SHARED_ROWS = W * (_MATRIX + MAXIMUM_ELBOWS + 5)
# Where elbows rub: the matrix again, what friction adds to it and what a radial newton would [1/kg], the free
# accelerations [m/s^2], each elbow's mobility [1/kg], friction per newton of its force, radial and tangential [-], 1
# for the elbows that push, and how hard they do [N].
MATRIX = U(PLAIN_SHARED_ROWS)
COUPLING = MATRIX + U(W * _MATRIX)
RADIAL_RISE = COUPLING + U(W * _MATRIX)
FREE_RISE = RADIAL_RISE + U(W * _MATRIX)
MOBILITY = FREE_RISE + U(W * MAXIMUM_ELBOWS)
SLIDE_R = MOBILITY + U(W * MAXIMUM_ELBOWS)
SLIDE_T = SLIDE_R + U(W * MAXIMUM_ELBOWS)
PUSHING = SLIDE_T + U(W * MAXIMUM_ELBOWS)
PUSH = PUSHING + U(W * MAXIMUM_ELBOWS)
PUSH_LIMIT = PUSH + U(W * MAXIMUM_ELBOWS)  # the largest push that friction goes with [N]
COME_UP = PUSH_LIMIT + U(W)  # speed over which friction comes up [m/s]
STEP = COME_UP + U(W)  # length of the step that the evaluation is for [s]
SHARED_ROWS = W * (4 * _MATRIX + 7 * MAXIMUM_ELBOWS + 8)


def offsets(
    lanes: int, *, table: bool, rubbing: bool, drive: bool, exponential: bool = True, reuse: bool = True
) -> dict[str, Any]:
    """Names of this file as a kernel knows them.

    Args:
        lanes: length of a row, a divisor of `BLOCK_LANES`.
        table: with a compliant table.
        rubbing: with friction on rigid elbows.
        drive: with gear friction, warm windings and a supply that sags.
        exponential: with exact decay of the currents.
        reuse: False gives each quantity of `REUSED` a separate row, which a test compares with.
    """
    known: dict[str, Any] = {
        name: U(int(value) * lanes // W) for name, value in globals().items() if type(value) is np.uint64
    }
    rows = SLOTS + (SWITCHED_SLOTS if table or rubbing or drive else 0)
    if not reuse:
        known.update({name: U(lanes * (rows + k)) for k, name in enumerate(REUSED)})
        rows += len(REUSED)
    stride = lanes * (rows + MAXIMUM_ELBOWS * (2 if rubbing else 1) + 1)
    known.update(W=lanes, U=U, Y=lanes * rows, X=lanes * (rows + MAXIMUM_ELBOWS), STRIDE=stride, NEXT=U(stride))
    known.update(TABLE=table, RUBBING=rubbing, DRIVE=drive, EXPONENTIAL=exponential)
    known.update(LOWEST_FREE=CONTACT_TOLERANCE if table else BELOW_TABLE_TOLERANCE)
    known.update(SHARED_ROWS=(SHARED_ROWS if rubbing else PLAIN_SHARED_ROWS) * lanes // W)
    return known

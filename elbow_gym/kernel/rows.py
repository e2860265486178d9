"""Rows of the public arrays that go in and out of the kernel, and the numbers its physics rests on. No Numba here."""

# Rows of a block's public arrays: state (B, STATE_ROWS, n) and parameters (B, PARAMETER_ROWS, n).
STATE = ("q", "q_dot", "current", "electrical_energy", "drawn_energy", "copper_loss", "friction_loss", "link_work")
STATE_ROWS = len(STATE)
# Behind them, in arrays for a kernel with a switch on: per joint or, for contacts, per contact point at the link's end;
# the supply's loss is stored with joint 1.
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
    # The rows below are read by kernels with a switch on alone.
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
    "bus_floor",  # least V0 CURRENT that the supply takes: 0, or far below without bound
)
PLAIN_PARAMETER_ROWS = 13
PARAMETER_ROWS = len(PARAMETERS)
# Columns of the per-arm summary (B, SUMMARY_COLUMNS + p): hand position, lowest joint or hand height, seconds spent
# below the table (accumulated), 1 while the state is representable, the largest vertical acceleration that an elbow has
# in spite of its force, or that steps or friction left it [m/s^2], then one force per elbow.
HAND, LOWEST, BELOW_TABLE, VALID, RESIDUAL, SUMMARY_COLUMNS = 0, 3, 4, 5, 6, 7
# Columns of the arms' clock, (B, 2): steps of a timestep, and control periods since the reset.
TIMESTEPS, PERIODS = 0, 1
# Columns of what each arm is to do, (B, columns): the largest action, volts per unit of action, delay of actions in
# control periods, the target's angle at the reset [rad], how far it turns in a control period [rad] and to the
# look-ahead target [rad], and the energy paid so far [J].
HIGHEST, VOLTS, DELAY, PHASE, TURN, AHEAD, PAID, TASK_COLUMNS = 0, 1, 2, 3, 4, 5, 6, 7
# Behind them where the task is observed: the circle's radius [m], signed rate of its angle [rad/s] and normal, the
# payload [kg], and the number of control periods in an episode.
RADIUS, ANGLE_RATE, NORMAL, LOAD, HORIZON, OBSERVED_TASK_COLUMNS = 7, 8, 9, 12, 13, 14
# Times of the further look-ahead targets, over that of the look-ahead target [-].
FURTHER = (3.0, 6.0, 12.0)
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
# Figures that are sums over the joints, with their row of STATE.
METERED = ((2, 3), (3, 4), (4, 7))
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
# Friction of a rigid elbow goes with its force up to this many times the largest force without friction: near a pose in
# which elbow and friction jam, Coulomb's law has no solution, or one without bound.
LARGEST_AMPLIFICATION = 10.0
# Largest rate times step [-] of the friction of slow elbows; where it would be faster, it comes up over higher speeds.
RESOLVED_FRICTION = 2.0
# Mean vertical acceleration [m/s^2] that a step may leave an elbow with, for the projection to take. The paper's arm
# has at most 2; with more, near poses in which elbows cannot move against each other, energy is wrong.
FREE_DRIFT = 100.0
# A projection onto the table is repeated while it turns a link by more than this [rad per m of it], so often at most.
SMALL_SHIFT = 1e-7
NEWTON_STEPS = 30

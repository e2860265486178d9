"""The compliant table under the end of a link, and the friction of gears."""

# pyright: basic

import numpy as np

from elbow_gym.kernel.rows import GEAR_SPEED
from elbow_gym.kernel.slots import (
    CONTACT_N, CONTACT_R, CONTACT_T, COULOMB, DISSIPATION, FRICTION_SPEED, GEAR, LOSS, NEXT, PSI_DOT, Q_DOT, STIFFNESS,
    TABLE_FRICTION, TWIST, Z_DOT,
)  # fmt: skip
from elbow_gym.kernel.template import template


@template(inlined=True)
def table_contact(ws, here, rho, rhod, z, zd):
    """Force of the compliant table on a link's end [N], its torque about the yaw so far [N m], and the power lost [W].

    Reads: STIFFNESS, DISSIPATION, TABLE_FRICTION, FRICTION_SPEED, PSI_DOT, TWIST.
    Writes: CONTACT_R, CONTACT_T, CONTACT_N, PSI_DOT, Z_DOT, TWIST, LOSS.
    """
    parent = here - NEXT
    psid = ws[parent + PSI_DOT]
    slide = rho * psid
    speed = ws[here + FRICTION_SPEED]
    spring = ws[here + STIFFNESS] * max(-z, 0.0)
    normal = max(spring * (1.0 - ws[here + DISSIPATION] * zd), 0.0)
    drag = -ws[here + TABLE_FRICTION] * normal / np.sqrt(rhod * rhod + slide * slide + speed * speed)
    radial = drag * rhod
    tangential = drag * slide
    ws[here + PSI_DOT] = psid
    ws[here + Z_DOT] = zd
    ws[here + CONTACT_R] = radial
    ws[here + CONTACT_T] = tangential
    ws[here + CONTACT_N] = normal
    ws[here + TWIST] = ws[parent + TWIST] + rho * tangential
    ws[here + LOSS] = (spring - normal) * zd - (radial * rhod + tangential * slide)


@template(inlined=True)
def gear_friction(ws, here):
    """Torque of a gear's Coulomb friction at the joint [N m], positive along the joint's motion.

    Reads: Q_DOT, COULOMB.
    Writes: GEAR.
    """
    q_dot = ws[here + Q_DOT]
    torque = ws[here + COULOMB] * q_dot / np.sqrt(q_dot * q_dot + GEAR_SPEED * GEAR_SPEED)
    ws[here + GEAR] = torque
    return torque

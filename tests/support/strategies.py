"""Hypothesis strategies: random arms of the family, their states and the elbows they can have.

Each is made once: a new one is checked at its first draw, which takes longer than the draw.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st

from elbow_gym import ArmParameters, LinkParameters, MotorParameters


class Case(NamedTuple):
    """One arm in one state, each array of shape (n,)."""

    arm: ArmParameters
    q: np.ndarray
    q_dot: np.ndarray
    current: np.ndarray
    voltage: np.ndarray
    elbows: tuple[int, ...]


integers = cache(st.integers)


@cache
def between(low, high):
    return st.floats(low, high, allow_subnormal=False)


@cache
def vectors(n, bound):
    return st.tuples(*[between(-bound, bound)] * n).map(np.array)


@cache
@st.composite
def links(draw, base=False):
    return LinkParameters(
        mass=draw(between(0.02, 2.0)),
        length=0.0 if base else draw(between(0.1, 1.0)),
        radius=draw(between(0.002, 0.05)),
    )


@cache
@st.composite
def motors(draw):
    return MotorParameters(
        armature_resistance=draw(between(0.3, 3.0)),
        armature_inductance=draw(between(5e-4, 5e-3)),
        torque_constant=draw(between(0.02, 0.4)),
        rotor_inertia=draw(between(1e-6, 1e-3)),
        gear_ratio=draw(between(1.0, 10.0)),
        gear_viscous_friction=draw(between(0.0, 0.02)),
    )


@cache
@st.composite
def arms(draw, smallest=3, largest=14):
    n = draw(integers(smallest, largest))
    return ArmParameters(
        links=(draw(links(base=True)), *(draw(links()) for _ in range(n - 1))),
        motors=tuple(draw(motors()) for _ in range(n)),
        joint_viscous_friction=tuple(draw(between(0.0, 1.0)) for _ in range(n)),
        nominal_pose=tuple(draw(vectors(n, 3.0))),
        gravity=draw(between(0.0, 20.0)),
    )


@cache
def elbow_tuples(n, most=4):
    """Up to `most` distinct joints from 3 on, in order."""
    return st.sets(integers(3, n), max_size=min(most, n - 2)).map(lambda e: tuple(sorted(e)))


@cache
@st.composite
def cases(draw, smallest=3, largest=14):
    """An arm and a state that need not hold its elbows on the table."""
    arm = draw(arms(smallest, largest))
    n = arm.n_joints
    return Case(
        arm,
        q=draw(vectors(n, 4.0)),
        q_dot=draw(vectors(n, 5.0)),
        current=draw(vectors(n, 10.0)),
        voltage=draw(vectors(n, 24.0)),
        elbows=draw(elbow_tuples(n)),
    )

"""Arms that several tests use, their poses, and the energy in them."""

from dataclasses import replace

import numpy as np

from elbow_gym import ArmParameters, LinkParameters, MotorParameters, dynamics, kinematics, paper_arm

ELBOWS = [0, 1, 2, (3, 5), (4, 7, 9)]
"""Sets of elbows: the paper's three, and two that are not."""
BEYOND_THE_PAPER = {
    "gear_coulomb_friction", "thermal_resistance", "heat_capacity", "temperature_coefficient", "temperature_limit",
}  # fmt: skip


def uneven_arm():
    """The paper's arm with every one of its constants scaled by its own factor at every joint."""
    rng = np.random.default_rng(7)

    def scattered(part):
        return {
            name: value * rng.uniform(0.7, 1.4) for name, value in vars(part).items() if name not in BEYOND_THE_PAPER
        }

    arm = paper_arm()
    return ArmParameters(
        links=tuple(LinkParameters(**scattered(link)) for link in arm.links),
        motors=tuple(MotorParameters(**scattered(motor)) for motor in arm.motors),
        joint_viscous_friction=tuple(rng.uniform(0.1, 0.6, 10)),
        nominal_pose=arm.nominal_pose,
    )


def shortened(arm, n):
    """The arm's first n joints."""
    per_joint = ("links", "motors", "joint_viscous_friction", "nominal_pose")
    return replace(arm, **{name: getattr(arm, name)[:n] for name in per_joint})


def small_arm(**motor):
    """Two unequal links behind the yaw, with friction in joints and gears."""
    return ArmParameters(
        links=(LinkParameters(length=0.0), LinkParameters(mass=0.4, length=0.5), LinkParameters(mass=0.2, length=0.3)),
        motors=(MotorParameters(**motor),) * 3,
        joint_viscous_friction=(0.05, 0.03, 0.02),
        nominal_pose=(0.0, 1.0, 1.0),
    )


def lying(arm, joint_height, hand_height):
    """Pose of the small arm with joint 3 and the hand at the given heights."""
    (_, upper), (_, fore) = ((link.mass, link.length) for link in arm.links[1:])
    first, second = np.arccos(joint_height / upper), np.arccos((hand_height - joint_height) / fore)
    return np.array([0.3, first, second - first])


def started(sim, seed=0):
    """Puts one arm on its elbows, moving along the table at random rates; returns the random generator."""
    rng = np.random.default_rng(seed)
    n = sim.arm.n_joints
    q = sim.on_table(sim.arm.nominal_pose + 0.1 * rng.normal(size=n))
    jacobian = kinematics.constraint_jacobian(sim.arm, q[0], sim.elbows)
    q_dot = (np.eye(n) - np.linalg.pinv(jacobian) @ jacobian) @ rng.normal(size=n)
    sim.reset(q, q_dot, rng.normal(size=n))
    return rng


def mechanical_energy(sim):
    """Kinetic energy of links and rotors plus potential energy of the links [J]."""
    q, q_dot = sim.q[0], sim.q_dot[0]
    z = kinematics.joint_positions(sim.arm, q)[:, 2]
    potential = sim.arm.gravity * sim.arm.of_links("mass") @ (z[1:] + z[:-1]) / 2.0
    return q_dot @ dynamics.mass_matrix(sim.arm, q) @ q_dot / 2.0 + potential


def inductor_energy(sim):
    """Energy of each armature's inductance [J], (n,)."""
    return sim.arm.of_motors("armature_inductance") * sim.current[0] ** 2 / 2.0


def six_joint_arm():
    """Six joints and longer links than the paper's, whose circle it cannot follow; joint 4 can lie on the table."""
    quarter = np.pi / 4.0
    return ArmParameters(
        links=(LinkParameters(length=0.0), *(LinkParameters(mass=0.2, length=0.4) for _ in range(5))),
        motors=(MotorParameters(gear_ratio=5.0),) * 6,
        joint_viscous_friction=(0.5,) * 6,
        nominal_pose=(0.0, quarter, 2.0 * quarter, -2.0 * quarter, quarter, quarter),
    )


def blow_up(env, i=0):
    """Makes arm i of an environment so fast that its next control step leaves what float64 can represent."""
    env.episodes.simulator.raw[0][i, 1] = 1e200

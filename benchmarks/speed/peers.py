"""MuJoCo and Pinocchio on the same arm. Both are imported only when a row of theirs is set up."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any
from xml.etree import ElementTree

import numpy as np

from benchmarks.speed.own import (
    CASES,
    ELBOWS,
    EULER_STEP,
    EVALUATION,
    PAPER_CASE,
    RK4_STEP,
    TIMESTEP,
    Array,
    Contender,
    Sampler,
    chain,
    kernel_accelerations,
    rk4_step,
    start_state,
    timed,
    voltages,
)
from elbow_gym import export
from elbow_gym.parameters import ArmParameters

MUJOCO, PINOCCHIO = "MuJoCo", "Pinocchio"
C_LOOP, PYTHON_LOOP = "C loop", "Python loop"
TOLERANCE = 1e-6
BALL_RADIUS, PLANE_MARGIN = 0.01, 0.001  # [m]
TOUCHING = {"condim": "1", "margin": str(PLANE_MARGIN)}
"""Attributes of balls and planes, which touch without friction."""


def mjcf(arm: ArmParameters, elbows: tuple[int, ...], integrator: str) -> str:
    """The arm as `elbow_gym.export` writes it, each elbow a frictionless ball between a floor and a ceiling.

    Both planes touch the ball within their margin, so that together they hold it from above and below. Sites and shapes
    that only show the arm are left out, since MuJoCo would spend time on them.
    """
    root = ElementTree.fromstring(export.mjcf(arm, timestep=TIMESTEP))
    root.find("option").set("integrator", integrator)
    for k, body in enumerate(list(root.iter("body")), start=1):
        for shown in (*body.findall("geom"), *body.findall("site")):
            body.remove(shown)
        if k in elbows:
            ElementTree.SubElement(body, "geom", {**TOUCHING, "size": str(BALL_RADIUS), "conaffinity": "1"})
    for z, up in ((-BALL_RADIUS, 1), (BALL_RADIUS, -1)) if elbows else ():
        plane = {"type": "plane", "size": "20 20 1", "contype": "1", "pos": f"0 0 {z}", "zaxis": f"0 0 {up}"}
        ElementTree.SubElement(root.find("worldbody"), "geom", {**TOUCHING, **plane})
    return ElementTree.tostring(root, encoding="unicode")


def mujoco_model(arm: ArmParameters, elbows: tuple[int, ...], integrator: str = "RK4") -> tuple[Any, Any]:
    """Model and data, at the start pose under this benchmark's voltages."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(mjcf(arm, elbows, integrator))
    # The force of the current as it is, not as it will be after the step.
    model.actuator_actearly[:] = 0
    data = mujoco.MjData(model)
    data.qpos[:] = start_state(arm, elbows, 1)[0, 0]
    data.ctrl[:] = voltages(1, arm.n_joints)[0]
    return model, data


def _mujoco(joints: int, elbows: int, integrator: str, loop: str) -> Sampler:
    import mujoco

    model, data = mujoco_model(chain(joints), ELBOWS[elbows], integrator)
    if loop == "mj_forward":

        def forward() -> None:
            for _ in range(100):
                mujoco.mj_forward(model, data)

        return timed(forward, 100)
    start, volts, steps = data.qpos.copy(), data.ctrl.copy(), 200

    def work() -> None:
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.ctrl[:] = start, volts
        if loop == C_LOOP:
            mujoco.mj_step(model, data, nstep=steps)
        else:
            for _ in range(steps):
                mujoco.mj_step(model, data)

    sampler = timed(work, steps)
    if data.warning.number.any():
        raise ArithmeticError(f"MuJoCo must step {joints} joints and {elbows} elbows without warnings")
    return sampler


class PinocchioArm:
    """The arm for Pinocchio: rotor inertia as armature, motors and friction in the joint torques.

    Args:
        arm: the arm.
        elbows: joints held at z = 0.
        volts: terminal voltages [V], (n,).
    """

    def __init__(self, arm: ArmParameters, elbows: tuple[int, ...], volts: Array) -> None:
        import pinocchio as pin

        self.pin, self.elbows, self.volts = pin, elbows, volts
        self.model, parent = pin.Model(), 0
        self.model.gravity.linear = np.array([0.0, 0.0, -arm.gravity])
        for k, link in enumerate(arm.links):
            place = pin.SE3(np.eye(3), np.array([0.0, 0.0, arm.links[k - 1].length if k else 0.0]))
            kind = pin.JointModelRY() if k else pin.JointModelRZ()
            parent = self.model.addJoint(parent, kind, place, f"joint{k}")
            inertia = np.diag([link.transverse_inertia, link.transverse_inertia, link.axial_inertia])
            self.model.appendBodyToJoint(
                parent, pin.Inertia(link.mass, np.array([0.0, 0.0, link.length / 2.0]), inertia), pin.SE3.Identity()
            )
        self.model.armature = arm.of_motors("reflected_inertia")
        self.data, self.zero = self.model.createData(), np.zeros(arm.n_joints)
        self.torque_constant = arm.of_motors("joint_torque_constant")
        self.friction = np.array(arm.joint_viscous_friction) + arm.of_motors("reflected_viscous_friction")
        self.resistance, self.inductance = (arm.of_motors(f"armature_{name}") for name in ("resistance", "inductance"))

    def torque(self, state: Array) -> Array:
        """Motor torque less friction [N m], (n,), of a state (3, n)."""
        return self.torque_constant * state[2] - self.friction * state[1]

    def free(self, q: Array, q_dot: Array, torque: Array) -> Array:
        """q_ddot [rad/s^2] without elbows, by the articulated-body algorithm."""
        return self.pin.aba(self.model, self.data, q, q_dot, torque)

    def held(self, q: Array, q_dot: Array, torque: Array) -> Array:
        """q_ddot [rad/s^2] with each elbow's height held exactly, through the heights' Jacobian."""
        pin, model, data, world = self.pin, self.model, self.data, self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pin.computeAllTerms(model, data, q, q_dot)
        pin.forwardKinematics(model, data, q, q_dot, self.zero)
        jacobian = np.stack([pin.getJointJacobian(model, data, joint, world)[2] for joint in self.elbows])
        bias = [pin.getClassicalAcceleration(model, data, joint, world).linear[2] for joint in self.elbows]
        return pin.forwardDynamics(model, data, torque, jacobian, np.array(bias), 0.0)

    def rate(self, state: Array) -> Array:
        """The rate of change (3, n) of a state (3, n): q, q_dot, current."""
        accelerations = self.held if self.elbows else self.free
        back_emf = self.torque_constant * state[1]
        current_dot = (self.volts - self.resistance * state[2] - back_emf) / self.inductance
        return np.stack([state[1], accelerations(state[0], state[1], self.torque(state)), current_dot])


def _pinocchio(joints: int, elbows: int, stepping: bool) -> Sampler:
    arm = PinocchioArm(chain(joints), ELBOWS[elbows], voltages(1, joints)[0])
    state = start_state(chain(joints), ELBOWS[elbows], 1)[0]
    if stepping:
        return timed(lambda: [rk4_step(arm.rate, state, TIMESTEP) for _ in range(20)], 20)
    accelerations, arguments = arm.held if elbows else arm.free, (state[0], state[1], arm.torque(state))
    return timed(lambda: [accelerations(*arguments) for _ in range(50)], 50)


def _difference(value: Array, expected: Array) -> float:
    return float(np.abs(value - expected).max() / np.abs(expected).max())


def agreement(library: str, joints: int, elbows: int, states: int = 5) -> float:
    """Largest relative difference [-] of a peer's q_ddot and current_dot to the kernel's over some moving states."""
    arm, rng, worst = chain(joints), np.random.default_rng(3), 0.0
    state = start_state(arm, ELBOWS[elbows], states)
    # Elbows stay where they are; without them the arm may move as it likes.
    state[:, 1:] = rng.normal(size=(states, 2, joints)) * (1.0 if elbows == 0 else [[0.0], [1.0]])
    volts = voltages(states, joints)
    evaluate, q_ddot, current_dot = kernel_accelerations(arm, ELBOWS[elbows], state, volts)
    evaluate()
    for k in range(states):
        if library == MUJOCO:
            import mujoco

            model, data = mujoco_model(arm, ELBOWS[elbows])
            (data.qpos[:], data.qvel[:], data.act[:]), data.ctrl[:] = state[k], volts[k]
            mujoco.mj_forward(model, data)
            found = data.qacc, data.act_dot
        else:
            found = PinocchioArm(arm, ELBOWS[elbows], volts[k]).rate(state[k])[1:]
        worst = max(worst, _difference(found[0], q_ddot[k]), _difference(found[1], current_dot[k]))
    return worst


def check_agreement() -> dict[str, float]:
    """Every peer's differences, by arm. ArithmeticError where one is a different arm; a missing peer is left out.

    MuJoCo's contacts are soft, so with elbows its difference is only reported.
    """
    found: dict[str, float] = {}
    for library in (MUJOCO, PINOCCHIO):
        for joints, elbows in dict.fromkeys([*((joints, 0) for joints, _ in CASES), *CASES]):
            try:
                difference = agreement(library, joints, elbows)
            except ImportError:
                break
            found[f"{library}, {joints} joints, {elbows} elbows"] = difference
            if difference > TOLERANCE and not (library == MUJOCO and elbows):
                raise ArithmeticError(
                    f"{library} must be the same arm to {TOLERANCE:g}, got {difference:.3g} at {joints} joints"
                )
    return found


def peer_contenders() -> list[Contender]:
    """MuJoCo by integrator and loop, Pinocchio free and with elbows."""
    plan: list[tuple[str, str, str, int, int, Callable[[], Sampler]]] = []
    for joints, elbows in CASES:
        for unit, name, integrator in (
            (RK4_STEP, C_LOOP, "RK4"),
            (EULER_STEP, C_LOOP, "Euler"),
            (EVALUATION, "mj_forward", "RK4"),
            (RK4_STEP, PYTHON_LOOP, "RK4"),
            (EULER_STEP, PYTHON_LOOP, "Euler"),
        ):
            if name != PYTHON_LOOP or (joints, elbows) == PAPER_CASE:
                make = lambda j=joints, e=elbows, i=integrator, n=name: _mujoco(j, e, i, n)  # noqa: E731
                plan.append((MUJOCO, name, unit, joints, elbows, make))
    for joints, elbows in dict.fromkeys([*((joints, 0) for joints, _ in CASES), *CASES]):
        name = "exact elbow path" if elbows else "articulated bodies (aba)"
        plan.append((PINOCCHIO, name, EVALUATION, joints, elbows, lambda j=joints, e=elbows: _pinocchio(j, e, False)))
    plan.append((PINOCCHIO, "exact elbow path", RK4_STEP, *PAPER_CASE, lambda: _pinocchio(*PAPER_CASE, True)))

    def with_stack(make: Callable[[], Sampler]) -> Callable[[ExitStack], Sampler]:
        return lambda _: make()

    return [
        Contender(family=family, name=name, unit=unit, joints=joints, elbows=elbows, make=with_stack(make))
        for family, name, unit, joints, elbows, make in plan
    ]

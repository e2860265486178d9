"""MuJoCo and Pinocchio on the same arm. Both are imported only when a row of theirs is set up."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

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
from elbow_gym.parameters import ArmParameters

MUJOCO, PINOCCHIO = "MuJoCo", "Pinocchio"
C_LOOP, PYTHON_LOOP = "C loop", "Python loop"
TOLERANCE = 1e-6
BALL_RADIUS, PLANE_MARGIN = 0.01, 0.001  # [m]


def mjcf(arm: ArmParameters, elbows: tuple[int, ...], integrator: str) -> str:
    """The arm for MuJoCo: native DC motors, each elbow a frictionless ball between a floor and a ceiling.

    Bodies have z along the link; armature is the reflected rotor inertia, damping all viscous friction. Both planes
    touch the ball within their margin, so that together they hold it from above and below.
    """
    bodies = ""
    for k, (link, motor) in enumerate(zip(arm.links, arm.motors, strict=True)):
        base = arm.links[k - 1].length if k else 0.0
        # Link 1 only yaws, so its inertia across is free; MuJoCo wants it safely above half of the one along.
        across = link.transverse_inertia * (1.0 if k else 2.0)
        damping = arm.joint_viscous_friction[k] + motor.reflected_viscous_friction
        ball = f'<geom type="sphere" size="{BALL_RADIUS}" conaffinity="1"/>' if k + 1 in elbows else ""
        bodies += f"""
            <body pos="0 0 {base!r}">
              <joint name="joint{k}" axis="{"0 1 0" if k else "0 0 1"}" armature="{motor.reflected_inertia!r}"
                     damping="{damping!r}"/>
              <inertial pos="0 0 {link.length / 2.0!r}" mass="{link.mass!r}"
                        diaginertia="{across!r} {across!r} {link.axial_inertia!r}"/>{ball}"""
    plane = '<geom type="plane" size="20 20 1" contype="1" pos="0 0 {}" zaxis="0 0 {}"/>'
    planes = plane.format(-BALL_RADIUS, 1) + plane.format(BALL_RADIUS, -1) if elbows else ""
    motors = "".join(
        f'<dcmotor joint="joint{k}" motorconst="{motor.joint_torque_constant!r}"'
        f' resistance="{motor.armature_resistance!r}" inductance="{motor.armature_inductance!r}"/>'
        for k, motor in enumerate(arm.motors)
    )
    return f"""
        <mujoco>
          <compiler angle="radian" boundmass="0" boundinertia="0"/>
          <option timestep="{TIMESTEP}" gravity="0 0 {-arm.gravity!r}" integrator="{integrator}"/>
          <default><geom contype="0" conaffinity="0" condim="1" margin="{PLANE_MARGIN}"/></default>
          <worldbody>{planes}{bodies}{"</body>" * arm.n_joints}</worldbody>
          <actuator>{motors}</actuator>
        </mujoco>"""


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

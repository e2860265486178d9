"""Contenders of this project: kernel, simulator, and the paper's method in NumPy. Peers are in peers.py."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elbow_gym.parameters import ArmParameters, LinkParameters, MotorParameters, paper_arm

Array = NDArray[np.float64]
Sampler = Callable[[float], float]
"""Function that works for about a number of seconds [s] and returns the time of one unit [s]."""

CLOCKS: dict[str, Callable[[], float]] = {"cpu": time.process_time, "wall": time.perf_counter}
TIMESTEP = 0.001
"""Length of a step [s] that arms of up to 40 joints allow; a step's cost does not depend on it."""
BATCH = 1024
OURS, PAPER = "elbow_gym", "the paper in NumPy"
EVALUATION, RK4_STEP, EULER_STEP, ENV_STEP = "evaluation", "RK4 step", "Euler step", "env step"
EXPONENTIAL_STEP = "exponential step"
OWN_STEPS = {RK4_STEP: "rk4", EXPONENTIAL_STEP: "exponential"}
"""Integrator of each of this project's steps."""


@dataclass(frozen=True, kw_only=True)
class Contender:
    """Row of the table: a unit of work, its arm, and how to set it up."""

    family: str
    name: str
    unit: str
    make: Callable[[ExitStack], Sampler]
    """Function that sets up a sampler and leaves what must be closed on the stack; ImportError without a library."""
    joints: int | None = None
    elbows: int | None = None
    arms: int = 1
    threads: int = 1
    clock: str = "cpu"
    rounds: int | None = None
    """Number of samples; with None one in each round, otherwise the contender is timed alone, after the rounds."""
    seconds: float | None = None
    """Approximate duration of a sample [s]; that of the others when None."""


def timed(work: Callable[[], Any], units: int, clock: str = "cpu") -> Sampler:
    """A sampler that repeats `work`, which does `units` units, on one of CLOCKS. Works once to warm up."""
    now = CLOCKS[clock]
    work()

    def sample(seconds: float) -> float:
        count, start = 0, now()
        while True:
            work()
            count += 1
            elapsed = now() - start
            if elapsed >= seconds:
                return elapsed / (count * units)

    return sample


def chain(joints: int) -> ArmParameters:
    """An arm of the paper's links and motors; its start pose zigzags over the table, elbows 4 and 7 on it."""
    if joints == paper_arm().n_joints:
        return paper_arm()
    turns = [0.0, 0.25, 0.5, -0.5, 0.25, 0.25, *(0.5 if k % 2 else -0.5 for k in range(6, joints))][:joints]
    return ArmParameters(
        links=(LinkParameters(length=0.0), *(LinkParameters() for _ in range(joints - 1))),
        motors=tuple(MotorParameters() for _ in range(joints)),
        joint_viscous_friction=(0.5,) * joints,
        nominal_pose=tuple(turn * np.pi for turn in turns),
    )


ELBOWS: dict[int, tuple[int, ...]] = {0: (), 1: (4,), 2: (4, 7), 8: (4, 7, 9, 11, 13, 15, 17, 19)}
PAPER_CASE = (10, 2)
CASES = ((10, 0), (10, 1), PAPER_CASE, (4, 1), (20, 2), (40, 2))
"""Number of joints and of elbows of every arm that is timed."""
MOST_ELBOWS = (20, 8)
"""Numbers of joints and elbows of the arm that only this project is timed with."""


def start_poses(arm: ArmParameters, elbows: tuple[int, ...], num_envs: int) -> Array:
    """Poses (B, n) around the start pose, the first exactly there, with the elbows on the table [rad]."""
    from elbow_gym.simulator import Simulator

    noise = 0.02 * np.random.default_rng(1).normal(size=(num_envs, arm.n_joints))
    noise[0] = 0.0
    return Simulator(arm, elbows, num_envs, timestep=TIMESTEP).on_table(np.array(arm.nominal_pose) + noise)


def voltages(num_envs: int, joints: int) -> Array:
    """Small constant voltages (B, n) [V], under which no arm flies off."""
    return np.random.default_rng(2).uniform(-2.0, 2.0, (num_envs, joints))


def kernel_accelerations(
    arm: ArmParameters, elbows: tuple[int, ...], state: Array, voltage: Array
) -> tuple[Callable[[], None], Array, Array]:
    """The kernel's evaluation of a batch of states (B, 3, n), as a call, with the q_ddot and current_dot it fills."""
    from elbow_gym.kernel.build import kernel
    from elbow_gym.kernel.rows import STATE_ROWS
    from elbow_gym.kernel.slots import BLOCK_LANES
    from elbow_gym.simulation.parameter_rows import parameter_table

    arms, _, joints = state.shape
    full = np.zeros((arms, STATE_ROWS, joints))
    full[:, :3] = state
    parameters = np.repeat(parameter_table(arm)[None], arms, axis=0)
    index = np.array(elbows, dtype=np.int64)
    q_ddot, current_dot, force = np.zeros((arms, joints)), np.zeros((arms, joints)), np.zeros((arms, len(elbows)))
    compiled = kernel(1 if arms == 1 else BLOCK_LANES).accelerations

    def evaluate() -> None:
        compiled(full, parameters, voltage, index, q_ddot, current_dot, force)

    return evaluate, q_ddot, current_dot


def compilations() -> list[Callable[[], None]]:
    """Calls that compile what the contenders call, a lane count and an integrator each."""

    def compile_one(arms: int, unit: str) -> None:
        _step(*PAPER_CASE, arms, unit)
        if unit == EXPONENTIAL_STEP:
            _evaluation(*PAPER_CASE, arms)

    return [partial(compile_one, arms, unit) for arms in (1, BATCH) for unit in OWN_STEPS]


def start_state(arm: ArmParameters, elbows: tuple[int, ...], num_envs: int) -> Array:
    """States (B, 3, n) at rest and without current: q, q_dot, current."""
    state = np.zeros((num_envs, 3, arm.n_joints))
    state[:, 0] = start_poses(arm, elbows, num_envs)
    return state


def _evaluation(joints: int, elbows: int, arms: int) -> Sampler:
    arm = chain(joints)
    state = start_state(arm, ELBOWS[elbows], arms)
    evaluate, _, _ = kernel_accelerations(arm, ELBOWS[elbows], state, voltages(arms, joints))
    calls = 200 if arms == 1 else 1
    return timed(lambda: [evaluate() for _ in range(calls)], calls * arms)


def _step(
    joints: int,
    elbows: int,
    arms: int,
    unit: str = RK4_STEP,
    threads: int = 1,
    clock: str = "cpu",
    parts: int = 1,
) -> Sampler:
    from elbow_gym.simulator import Simulator

    arm = chain(joints)
    how: dict[str, Any] = {"integrator": OWN_STEPS[unit], "num_threads": threads}
    simulator = Simulator(arm, ELBOWS[elbows], arms, timestep=TIMESTEP, **how)
    simulator.reset(start_poses(arm, ELBOWS[elbows], arms))
    start, volts = simulator.get_state(), voltages(arms, joints)
    substeps = 500 if arms == 1 else 50

    def work() -> None:
        simulator.set_state(start)
        simulator.step(volts, substeps)

    return timed(work, parts * substeps * arms, clock)


def rk4_step(rate: Callable[[Array], Array], state: Array, step: float) -> Array:
    """The classical Runge-Kutta step of state' = rate(state)."""
    k1 = rate(state)
    k2 = rate(state + step / 2.0 * k1)
    k3 = rate(state + step / 2.0 * k2)
    k4 = rate(state + step * k3)
    return state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def _reference(joints: int, elbows: int, stepping: bool) -> Sampler:
    from elbow_gym.dynamics import forward_dynamics

    arm = chain(joints)
    state, volts = start_state(arm, ELBOWS[elbows], 1)[0], voltages(1, joints)[0]

    def rate(state: Array) -> Array:
        found = forward_dynamics(arm, *state, volts, ELBOWS[elbows])
        return np.stack([state[1], found.q_ddot, found.current_dot])

    return timed(lambda: rk4_step(rate, state, TIMESTEP) if stepping else rate(state), 1)


def own_contenders() -> list[Contender]:
    """The kernel's evaluations, the simulator's steps, and the paper's method."""
    found: list[Contender] = []
    for joints, elbows in (*CASES, MOST_ELBOWS):
        arm: dict[str, Any] = {"joints": joints, "elbows": elbows}
        for arms, name in ((1, "kernel, called from Python"), (BATCH, "kernel, batch")):
            found.append(
                Contender(
                    family=OURS,
                    name=name,
                    unit=EVALUATION,
                    make=lambda _, a=arm, arms=arms: _evaluation(**a, arms=arms),
                    arms=arms,
                    **arm,
                )
            )
        # A call of the kernel mostly gathers parameters and states, which a run does once for many evaluations.
        found.append(
            Contender(
                family=OURS,
                name="quarter of an RK4 step, batch",
                unit=EVALUATION,
                make=lambda _, a=arm: _step(**a, arms=BATCH, parts=4),
                arms=BATCH,
                **arm,
            )
        )
        for unit in (RK4_STEP, EXPONENTIAL_STEP) if (joints, elbows) == PAPER_CASE else (RK4_STEP,):
            for name, arms, threads in (("single arm", 1, 1), ("batch", BATCH, 1), ("batch, 2 threads", BATCH, 2)):
                how: dict[str, Any] = {"arms": arms, "threads": threads, "clock": "cpu" if threads == 1 else "wall"}
                found.append(
                    Contender(
                        family=OURS,
                        name=name,
                        unit=unit,
                        make=lambda _, a=arm, u=unit, how=how: _step(**a, unit=u, **how),
                        **arm,
                        **how,
                    )
                )
    for joints, elbows in ((10, 0), PAPER_CASE):
        for unit in (EVALUATION, RK4_STEP) if elbows else (EVALUATION,):
            found.append(
                Contender(
                    family=PAPER,
                    name="Newton-Euler columns, dense solve",
                    unit=unit,
                    joints=joints,
                    elbows=elbows,
                    make=lambda _, j=joints, e=elbows, u=unit: _reference(j, e, u == RK4_STEP),
                )
            )
    return found

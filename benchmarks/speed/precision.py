"""Work and precision: errors of one simulated second against its CPU time, by integrator and number of steps.

The paper's arm without elbows and contact, from its nominal pose, under random voltages held for a control period: what
an environment plays under uniform actions. This project's integrators and MuJoCo's move the same arm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from benchmarks.speed.own import OURS, TIMESTEP, Array, Contender, Sampler, timed
from benchmarks.speed.peers import MUJOCO, mujoco_model
from benchmarks.speed.rows import Row
from elbow_gym.parameters import paper_arm
from elbow_gym.simulator import Simulator
from elbow_gym.task.settings import Settings

SECOND = "simulated second"
DEFAULT = Settings(elbows=0)
PERIOD = DEFAULT.control_period
PERIODS = round(1.0 / PERIOD)
VOLTAGES = np.random.default_rng(4).uniform(-1.0, 1.0, (PERIODS, paper_arm().n_joints)) * DEFAULT.voltage_limit
"""Voltage of each control period and joint [V]."""
BATCH = 64
ERROR = 1e-4
"""Error at which CPU times are compared [-]."""
GROWING = "exponential, growing steps"
"""The environment's own steps in a control period, each cut into equal parts."""
COUNTS = (5, 10, 20, 40, 80)
METHODS: dict[tuple[str, str, int], tuple[int, ...]] = {
    (OURS, GROWING, BATCH): COUNTS,
    (OURS, GROWING, 1): COUNTS,
    (OURS, "exponential", 1): COUNTS,
    (OURS, "rk4", 1): (10, 20, 40, 80),
    **{(MUJOCO, name, 1): (10, 20, 50, 100, 200, 500, 1000) for name in ("Euler", "implicitfast", "RK4")},
}
"""Numbers of steps in a control period by family, integrator and number of arms."""
TRUE_STEPS = 1000
"""Steps of the reference in a control period."""


class Run(Protocol):
    """A second that can be played again and again."""

    def periods(self) -> Iterator[None]:
        """Starts again and plays the control periods, with a halt after each."""
        ...

    def state(self) -> Array:
        """Angles, rates and currents of an arm now, (3, n)."""
        ...

    def energy(self, states: Sequence[Array]) -> float:
        """Electrical energy of the second [J], which may be taken from the states at the ends of all periods."""
        ...


@dataclass(frozen=True)
class Trial:
    """An integrator and the number of its steps in a control period."""

    family: str
    integrator: str
    arms: int
    substeps: int

    @property
    def steps(self) -> Array:
        """Lengths of the steps in a control period [s]."""
        if self.integrator != GROWING:
            return np.full(self.substeps, PERIOD / self.substeps)
        parts = self.substeps // len(DEFAULT.substeps)
        return np.repeat(DEFAULT.substeps / parts, parts)

    def contender(self) -> Contender:
        """Row of a timing."""
        return Contender(
            family=self.family,
            name=f"{self.integrator}, {self.substeps} steps a period",
            unit=SECOND,
            make=self._sampler,
            joints=paper_arm().n_joints,
            elbows=0,
            arms=self.arms,
            seconds=0.02,
        )

    def _sampler(self, _: ExitStack) -> Sampler:
        run = run_of(self)

        def play() -> None:
            for _ in run.periods():
                pass

        return timed(play, self.arms)


class _OwnRun:
    def __init__(self, trial: Trial) -> None:
        name = "exponential" if trial.integrator == GROWING else trial.integrator
        self._simulator = Simulator("paper", 0, trial.arms, timestep=TIMESTEP, integrator=name)
        self._start, self._steps = self._simulator.get_state(), trial.steps
        self._voltages = np.repeat(VOLTAGES[:, None], trial.arms, axis=1)

    def periods(self) -> Iterator[None]:
        self._simulator.set_state(self._start)
        for voltage in self._voltages:
            self._simulator.advance(voltage, self._steps)
            yield

    def state(self) -> Array:
        simulator = self._simulator
        return np.stack([simulator.q[0], simulator.q_dot[0], simulator.current[0]])

    def energy(self, _: Sequence[Array]) -> float:
        return float(self._simulator.electrical_energy[0].sum())


class _MuJoCoRun:
    def __init__(self, trial: Trial) -> None:
        import mujoco

        self._arm = paper_arm()
        self._model, self._data = mujoco_model(self._arm, (), trial.integrator)
        self._model.opt.timestep = PERIOD / trial.substeps
        self._start, self._substeps = self._data.qpos.copy(), trial.substeps
        self._reset, self._step = mujoco.mj_resetData, mujoco.mj_step

    def periods(self) -> Iterator[None]:
        self._reset(self._model, self._data)
        self._data.qpos[:] = self._start
        for voltage in VOLTAGES:
            self._data.ctrl[:] = voltage
            self._step(self._model, self._data, nstep=self._substeps)
            yield

    def state(self) -> Array:
        return np.stack([self._data.qpos, self._data.qvel, self._data.act])

    def energy(self, states: Sequence[Array]) -> float:
        """The winding's equation, integrated over each period: R int i = v h - K_m dq - L di."""
        change = np.diff([np.stack([self._start, *np.zeros((2, self._start.size))]), *states], axis=0)
        back_emf = self._arm.of_motors("joint_torque_constant") * change[:, 0]
        stored = self._arm.of_motors("armature_inductance") * change[:, 2]
        charge = (VOLTAGES * PERIOD - back_emf - stored) / self._arm.of_motors("armature_resistance")
        return float((VOLTAGES * charge).sum())


def run_of(trial: Trial) -> Run:
    """The run of a trial. ImportError where its library is missing."""
    return _OwnRun(trial) if trial.family == OURS else _MuJoCoRun(trial)


def outcome(trial: Trial) -> tuple[Array, float]:
    """State of an arm (3, n) and electrical energy [J] after the second."""
    run = run_of(trial)
    states = [run.state() for _ in run.periods()]
    return states[-1], run.energy(states)


def truth(integrator: str = "exponential") -> tuple[Array, float]:
    """The outcome in a thousand steps a period."""
    return outcome(Trial(OURS, integrator, 1, TRUE_STEPS))


def errors(found: tuple[Array, float], true: tuple[Array, float]) -> tuple[float, float]:
    """Error of the state [-] and of the energy [-].

    That of the state is the largest over angles, rates and currents, each relative to the largest of its kind.
    """
    scale = np.abs(true[0]).max(axis=1, keepdims=True)
    return float((np.abs(found[0] - true[0]) / scale).max()), abs(found[1] / true[1] - 1.0)


def trials(quick: bool = False) -> list[Trial]:
    """All trials, those with few steps first in each method; only two of each method if `quick`."""
    return [Trial(*method, count) for method, counts in METHODS.items() for count in counts[: 2 if quick else None]]


@dataclass(frozen=True)
class Point:
    """Work and precision of a trial."""

    trial: Trial
    row: Row
    state_error: float
    """Error of the state [-], as of `errors`."""
    energy_error: float
    """Error of the electrical energy [-]."""

    @property
    def time(self) -> float:
        """CPU time of the simulated second of one arm [s], the fastest sample: a busy machine only adds to it."""
        return min(self.row.samples)


def points(chosen: Sequence[Trial], rows: Sequence[Row]) -> list[Point]:
    """Points of the trials that were timed; rows are those of `Trial.contender`."""
    true, timings = truth(), {(row.contender.family, row.contender.name, row.contender.arms): row for row in rows}
    found: list[Point] = []
    for trial in chosen:
        who = trial.contender()
        row = timings.get((who.family, who.name, who.arms))
        if row is not None:
            found.append(Point(trial, row, *errors(outcome(trial), true)))
    return found


@dataclass(frozen=True)
class Method:
    """An integrator with its points, from few to many steps."""

    family: str
    integrator: str
    arms: int
    points: tuple[Point, ...]

    @property
    def order(self) -> float:
        """Order of the state's error [-], from the two shortest steps."""
        coarse, fine = self.points[-2:]
        return math.log(coarse.state_error / fine.state_error) / math.log(fine.trial.substeps / coarse.trial.substeps)

    def time_at(self, error: float, of: Callable[[Point], float]) -> float | None:
        """CPU time [s] from which on the error stays within a bound, between two points in logarithms.

        That of the longest steps where they are within it already, None where the shortest are not.
        """
        missed = [k for k, point in enumerate(self.points) if of(point) > error]
        if not missed:
            return self.points[0].time
        if missed[-1] + 1 == len(self.points):
            return None
        coarse, fine = self.points[missed[-1]], self.points[missed[-1] + 1]
        share = math.log(of(coarse) / error) / math.log(of(coarse) / of(fine))
        return coarse.time ** (1.0 - share) * fine.time**share


def methods(found: Sequence[Point]) -> list[Method]:
    """Points by method, in their order."""
    return [
        Method(*method, tuple(point for point in found if _method(point.trial) == method))
        for method in dict.fromkeys(_method(point.trial) for point in found)
    ]


def _method(trial: Trial) -> tuple[str, str, int]:
    return trial.family, trial.integrator, trial.arms


def best(chosen: Sequence[Method], error: float, of: Callable[[Point], float]) -> float | None:
    """Shortest CPU time [s] of MuJoCo's integrators at an error; None where none reaches it."""
    times = [method.time_at(error, of) for method in chosen if method.family == MUJOCO]
    return min((time for time in times if time is not None), default=None)

"""Settings of an environment: one frozen dataclass, validated once, shared by the single and the batched form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from elbow_gym.checks import LARGEST_INTEGER, non_negative, one_of, positive
from elbow_gym.parameters import ARM_SUFFIX, ArmParameters, Array, as_arm, as_elbows
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import quantities
from elbow_gym.simulation.rates import Start, rates, worst_rows
from elbow_gym.simulation.state_checks import check_angles
from elbow_gym.simulation.step_limit import INTEGRATORS, check_option, check_timestep, schedule
from elbow_gym.table import TableParameters, as_table
from elbow_gym.task.circle import Circle, as_circle
from elbow_gym.task.default_circle import default_circle
from elbow_gym.task.randomization import Randomization, as_ranges
from elbow_gym.task.ranges import ends
from elbow_gym.task.reach import check_reachable, extreme_points

ACTION_UNITS = ("fraction", "volt")
STARTS = ("paper", "on_target")
# Rounding of a circle's height [m], and relative of its period.
HAIR = 1e-9


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Arguments of the environments. Raises ValueError naming the argument, the rule and the value."""

    elbows: int | tuple[int, ...] = 2
    """Elbows on the table: 0, 1, 2 as in the paper (joints (), (4,), (4, 7)), or joint numbers held at z = 0."""
    arm: str | ArmParameters | Mapping[str, Any] = "paper"
    """Preset name, path of a JSON file, an ArmParameters, or its JSON dict; a file is read once, into a dict."""
    control_frequency: float = 50.0
    """Control periods per second [Hz]; an action is held for one."""
    timestep: float | None = None
    """Longest step of the integrator [s], a whole number of which make a control period; refused where it is too long.

    None: steps that grow after the voltage's jump, as long as the fastest rate of what was asked for allows.
    """
    integrator: str = "exponential"
    """Runge-Kutta method of order 4: "exponential", with exact decay of the currents, or "rk4", the classical one."""
    duration: float = 5.0
    """Episode length [s]."""
    voltage_limit: float = 24.0
    """Supply voltage of every motor [V]."""
    action_unit: str = "fraction"
    """Unit of the actions: "fraction" of the supply voltage, in [-1, 1], or "volt"."""
    start: str = "paper"
    """Start pose: "paper", the arm's nominal pose; "on_target", the pose whose hand is on the circle, by the yaw and
    the last two links where these reach it."""
    start_noise: float = 0.02
    """Standard deviation of the start pose [rad], projected onto the elbows' plane."""
    start_spread: float = 0.0
    """Largest difference of a joint's angle from the paper's start pose [rad]: uniform draws, put on the elbows' plane,
    until every joint and the hand are at z >= 0."""
    circle: Mapping[str, Any] | Circle | None = None
    """Dict of `Circle` fields, the paper's where one is missing; None: the paper's, or one in the reach of an arm that
    cannot follow it with its last two links."""
    tracking_weight: float = 1.0
    """Cost per metre of tracking error [1/m]."""
    energy_weight: float = 0.001
    """Cost per watt of electrical power [1/W]."""
    regeneration: bool = True
    """Whether negative electrical power is credited, and taken back by the supply."""
    table: bool | Mapping[str, Any] | TableParameters = False
    """A compliant table under joints 3..n and the hand: True, or a dict of `TableParameters` fields."""
    elbow_friction: float = 0.0
    """Coulomb's coefficient of rigid elbows on the table, where they push [-], at most 1."""
    gear_coulomb_friction: float | None = None
    """Coulomb friction of every gear, at the motor shaft [N m]; the arm's own when None."""
    heat: bool = False
    """Whether windings warm up, and their resistance with them."""
    supply_resistance: float = 0.0
    """Resistance inside the motors' common supply [ohm], which makes its voltage sag."""
    payload: float = 0.0
    """Mass at the hand [kg]."""
    randomize: Mapping[str, Any] | str | None = None
    """Dict of ranges that `Randomization` draws from at each reset, or "tasks": payloads that the elbows allow."""
    task_observation: bool = False
    """Whether observations say what the task is: circle, payload, targets further ahead and the time left."""

    def __post_init__(self) -> None:
        if isinstance(self.arm, str) and self.arm.endswith(ARM_SUFFIX):
            # The file may change, and what is saved of these settings must not change with it.
            object.__setattr__(self, "arm", as_arm(self.arm).to_dict())
        for name in ("control_frequency", "duration", "voltage_limit"):
            positive(name, getattr(self, name))
        for name in ("start_noise", "start_spread", "tracking_weight", "energy_weight"):
            non_negative(name, getattr(self, name))
        for name, allowed in (("action_unit", ACTION_UNITS), ("start", STARTS), ("integrator", INTEGRATORS)):
            one_of(name, getattr(self, name), allowed)
        if not isinstance(self.task_observation, bool):
            raise ValueError(f"task_observation must be True or False, got {self.task_observation!r}")
        if self.duration * self.control_frequency > LARGEST_INTEGER:
            raise ValueError(f"duration must be a countable number of control periods, got {self.duration}")
        if self.horizon < 1:
            raise ValueError(
                f"duration must be at least one control period ({1 / self.control_frequency:g} s), got {self.duration}"
            )
        check_reachable(self._shortest_arm(), self.elbow_joints, self.parsed_circle)
        self.check_followable(self.parsed_circle)
        _ = self.substeps

    @cached_property
    def parsed_arm(self) -> ArmParameters:
        """The arm that `arm` names."""
        arm = as_arm(self.arm)
        check_angles("nominal_pose", np.array(arm.nominal_pose))
        if self.gear_coulomb_friction is None:
            return arm
        friction = non_negative("gear_coulomb_friction", self.gear_coulomb_friction)
        return replace(arm, motors=tuple(replace(motor, gear_coulomb_friction=friction) for motor in arm.motors))

    def check_followable(self, circle: Circle) -> None:
        """Raises ValueError where a target turns more than once in a control period, or goes below a compliant table.

        So it does where the task is observed and the path has no plane. Covers every circle that may be drawn.
        """
        if self.task_observation and not isinstance(circle.shape, str):
            raise ValueError(
                f"circle shape must have a plane where the task is observed, got {len(circle.shape)} points"
            )
        shortest = ends(circle.period)[0]
        if shortest < self.control_period * (1.0 - HAIR):
            raise ValueError(
                f"circle period must be at least one control period ({self.control_period:g} s), got {shortest:g}"
            )
        depth = -extreme_points(circle)[:, 2].min()
        if self.conditions.surface is not None and depth > HAIR:
            raise ValueError(f"circle must not go below the table, which pushes, got {depth:.4g} m below z = 0")

    def given_circle(self, given: object) -> Circle:
        """The circle of a reset's option, a dict of fields that replace the environment's, which None leaves.

        Raises ValueError naming the field, or where the hand or the table forbids it.
        """
        if given is None:
            return self.parsed_circle
        if not isinstance(given, Mapping):
            raise ValueError(f"options['circle'] must be a dict of circle fields, got {given!r}")
        circle = Circle.from_dict({**self.parsed_circle.to_dict(), **cast("Mapping[str, Any]", given)})
        check_reachable(self.parsed_arm, self.elbow_joints, circle)
        self.check_followable(circle)
        return circle

    def check_steps(self, option: str, rows: Array, volts: Array, start: Start | None = None) -> None:
        """Raises ValueError naming a reset's option unless the steps resolve arms put in some states.

        Args:
            option: its name.
            rows: the arms' rows for the kernel, (k, PARAMETER_ROWS, n).
            volts: their supply voltages [V], (k,).
            start: what moves or is warm in their states; nothing when None.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            found = self._rates(rows, volts, start)
        check_option(option, float(self.substeps.max()), found, self.integrator)

    def _shortest_arm(self) -> ArmParameters:
        shortest = self.randomization.lowest("length")
        links = (replace(link, length=shortest * link.length) for link in self.parsed_arm.links)
        return self.parsed_arm if shortest == 1.0 else replace(self.parsed_arm, links=tuple(links))

    @cached_property
    def conditions(self) -> Conditions:
        """Load, table, friction, heat and supply that the arm works under."""
        return Conditions(
            payload=self.payload,
            table=as_table(self.table),
            elbow_friction=self.elbow_friction,
            heat=self.heat,
            supply_voltage=self.voltage_limit,
            supply_resistance=self.supply_resistance,
            regeneration=self.regeneration,
        )

    @cached_property
    def randomization(self) -> Randomization:
        """Ranges that each reset draws from."""
        return Randomization(as_ranges(self.randomize, len(self.elbow_joints)))

    @cached_property
    def parsed_circle(self) -> Circle:
        """The circle that `circle` describes."""
        return default_circle(self.parsed_arm, self.elbow_joints) if self.circle is None else as_circle(self.circle)

    @cached_property
    def elbow_joints(self) -> tuple[int, ...]:
        """Joint numbers of the elbows, ascending."""
        return as_elbows(self.elbows, self.parsed_arm.n_joints)

    @cached_property
    def basis(self) -> dict[str, Any]:
        """Values by name that a saved state rests on: with another one it would mean, or lead to, something else."""
        conditions = self.conditions
        return {
            "elbows": self.elbow_joints,
            "arm": self.parsed_arm,
            "control_frequency": self.control_frequency,
            "timestep": self.timestep,
            "integrator": self.integrator,
            # Classical steps are short enough for windings as warm as an episode makes them.
            "duration": self.duration if self.heat and self.integrator == "rk4" else None,
            "action_unit": self.action_unit,
            "table": conditions.surface,
            "voltage_limit": conditions.supply_voltage,
            **{
                name: getattr(conditions, name)
                for name in ("elbow_friction", "heat", "supply_resistance", "regeneration", "payload")
            },
        }

    @property
    def control_period(self) -> float:
        """Time between two actions [s]."""
        return 1.0 / self.control_frequency

    @cached_property
    def substeps(self) -> Array:
        """Lengths of the integrator's steps in a control period [s]."""
        if self.timestep is None:
            return schedule(self.control_period, self.rates, self.integrator)
        timestep = positive("timestep", self.timestep)
        check_timestep(timestep, self.control_period, self.rates, self.integrator)
        # A hair is taken off so that 0.02 s / 0.002 s is 10 whatever its rounding.
        count = max(1, math.ceil(self.control_period / timestep - 1e-9))
        return np.full(count, self.control_period / count)

    @cached_property
    def rates(self) -> dict[str, float]:
        """Fastest rates of any arm that may be drawn [1/s], by the names of `rates.MECHANISMS`."""
        arm, ranges = self.parsed_arm, self.randomization.ranges
        rows, volts = worst_rows(quantities(arm), arm.gravity, self.conditions, ranges)
        return self._rates(rows, volts)

    def _rates(self, rows: Array, volts: ArrayLike, start: Start | None = None) -> dict[str, float]:
        elbows = bool(self.elbow_joints)
        return rates(rows, self.conditions, volts, elbows=elbows, start=start, duration=self.duration)

    @property
    def horizon(self) -> int:
        """Number of control periods in an episode."""
        return round(self.duration * self.control_frequency)

    @property
    def arguments(self) -> dict[str, Any]:
        """The arguments by name, as they were given."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

"""What an environment is asked for: one frozen dataclass, validated once, shared by the single and the batched form."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

from elbow_gym.circle import Circle, as_circle, check_reachable
from elbow_gym.parameters import ArmParameters, as_arm, as_elbows, non_negative, positive

ACTION_UNITS = ("fraction", "volt")
STARTS = ("paper", "on_target")


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Arguments of the environments. Raises ValueError naming the argument, the rule and the value."""

    elbows: int | tuple[int, ...] = 2
    """0, 1, 2 as in the paper (joints (), (4,), (4, 7)), or joint numbers held at z = 0."""
    arm: str | ArmParameters | Mapping[str, Any] = "paper"
    """Preset name, an ArmParameters, or its JSON dict."""
    control_frequency: float = 50.0
    """How often an action is read [Hz]; it is held in between."""
    timestep: float = 0.002
    """Longest RK4 step [s]; divided so that a whole number fits one control period."""
    duration: float = 5.0
    """Episode length [s]."""
    voltage_limit: float = 24.0
    """Supply voltage of every motor [V]."""
    action_unit: str = "fraction"
    """"fraction" of the supply voltage in [-1, 1], or "volt"."""
    start: str = "paper"
    """"paper": the arm's nominal pose; "on_target": the pose whose hand is on the circle."""
    start_noise: float = 0.02
    """Standard deviation of the start pose [rad], projected onto the elbows' plane."""
    circle: Mapping[str, Any] | Circle | None = None
    """Dict of `Circle` fields, the paper's where one is missing."""
    tracking_weight: float = 1.0
    """Reward per metre of tracking error [1/m]."""
    energy_weight: float = 0.001
    """Reward per watt of electrical power [1/W]."""
    regeneration: bool = True
    """Whether negative electrical power is credited."""

    def __post_init__(self) -> None:
        for name in ("control_frequency", "timestep", "duration", "voltage_limit"):
            positive(name, getattr(self, name))
        for name in ("start_noise", "tracking_weight", "energy_weight"):
            non_negative(name, getattr(self, name))
        for name, allowed in (("action_unit", ACTION_UNITS), ("start", STARTS)):
            if getattr(self, name) not in allowed:
                raise ValueError(f"{name} must be one of {allowed}, got {getattr(self, name)!r}")
        if not isinstance(self.regeneration, bool):
            raise ValueError(f"regeneration must be True or False, got {self.regeneration!r}")
        if not math.isfinite(self.duration * self.control_frequency):
            raise ValueError(f"duration must be a countable number of control periods, got {self.duration}")
        if self.horizon < 1:
            raise ValueError(
                f"duration must be at least one control period ({1 / self.control_frequency:g} s), got {self.duration}"
            )
        check_reachable(self.parsed_arm, self.elbow_joints, self.parsed_circle)

    @cached_property
    def parsed_arm(self) -> ArmParameters:
        """The arm that `arm` names."""
        return as_arm(self.arm)

    @cached_property
    def parsed_circle(self) -> Circle:
        """The circle that `circle` describes."""
        return as_circle(self.circle)

    @cached_property
    def elbow_joints(self) -> tuple[int, ...]:
        """Joint numbers of the elbows, ascending."""
        return as_elbows(self.elbows, self.parsed_arm.n_joints)

    @property
    def control_period(self) -> float:
        """Time between two actions [s]."""
        return 1.0 / self.control_frequency

    @property
    def n_substeps(self) -> int:
        """RK4 steps in a control period."""
        # A hair is taken off so that 0.02 s / 0.002 s is 10 whatever its rounding.
        return max(1, math.ceil(self.control_period / self.timestep - 1e-9))

    @property
    def horizon(self) -> int:
        """Control periods in an episode."""
        return round(self.duration * self.control_frequency)

    @property
    def arguments(self) -> dict[str, Any]:
        """The arguments by name, as they were given."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

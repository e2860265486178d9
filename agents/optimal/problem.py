"""Problem of the bound: one episode of an environment from its start without noise, with what the program knows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.planning.task import check_modelled
from elbow_gym.kinematics import inverse_kinematics
from elbow_gym.simulator import Simulator
from elbow_gym.task.settings import Settings

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Problem:
    """Problem of least negative return of one episode of an environment from its start without noise.

    Raises ValueError naming what the program does not know: contact, friction, heat, a supply's resistance, randomness.
    """

    settings: Settings
    above_table: bool = False
    """Whether joints 3..n and the hand must have z >= 0."""

    def __post_init__(self) -> None:
        settings = self.settings
        check_modelled(settings)
        if settings.randomization.ranges:
            raise ValueError(f"randomize must be off where a bound is asked for, got {settings.randomize!r}")
        if settings.parsed_circle.drawn:
            names = ", ".join(settings.parsed_circle.drawn)
            raise ValueError(f"circle must be fixed where a bound is asked for, got a random {names}")
        lowest = float(self.target[:, 2].min())
        if self.above_table and lowest < 0.0:
            raise ValueError(f"above_table must be False where the path is below the table, got {lowest:.4g} m")

    @cached_property
    def start(self) -> Array:
        """Start pose [rad], (n,), with the elbows at z = 0."""
        settings, arm, circle = self.settings, self.settings.parsed_arm, self.settings.parsed_circle
        simulator = Simulator(arm, settings.elbow_joints, timestep=float(settings.substeps.min()))
        pose = simulator.on_table(arm.nominal_pose)[0]
        if settings.start == "paper":
            return pose
        return inverse_kinematics(arm, pose, circle.position(circle.angle(0.0, float(circle.phase))))[0]

    @cached_property
    def target(self) -> Array:
        """Targets at the ends of the control periods [m], (N, 3)."""
        circle, settings = self.settings.parsed_circle, self.settings
        time = settings.control_period * np.arange(1, settings.horizon + 1)
        return circle.position(circle.angle(time, float(circle.phase)))

    @property
    def question(self) -> dict[str, Any]:
        """All that the solution depends on, in JSON types, but for how the simulator steps."""
        settings, circle = self.settings, self.settings.parsed_circle
        return {
            **self.frame,
            "start": self.start.tolist(),
            "path": circle.path.tolist(),
            "rate": circle.rate,
            "phase": float(circle.phase),
            "tracking_weight": settings.tracking_weight,
            "energy_weight": settings.energy_weight,
            "payload": settings.payload,
        }

    @property
    def frame(self) -> dict[str, Any]:
        """What two problems must share for one to be solved from the other: arm, elbows, supply, periods."""
        settings = self.settings
        return {
            "arm": {name: value for name, value in settings.parsed_arm.to_dict().items() if name != "nominal_pose"},
            "elbows": list(settings.elbow_joints),
            "voltage_limit": settings.voltage_limit,
            "control_frequency": settings.control_frequency,
            "horizon": settings.horizon,
            "above_table": self.above_table,
        }

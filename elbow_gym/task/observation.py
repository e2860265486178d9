"""Entries of the observation: their names, units, scales and limits, and how they are decoded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elbow_gym.kernel.rows import FURTHER, HORIZON, OBSERVED_TASK_COLUMNS, TASK_COLUMNS
from elbow_gym.parameters import Array

OBSERVATION_VERSION = 1
LOOKAHEAD = 0.1
"""Time by which the look-ahead target is ahead of the target [s]."""


class Feature(NamedTuple):
    """A group of observation entries of one kind."""

    name: str
    unit: str
    scale: float
    """Quantity per unit of an entry, in the quantity's unit."""
    limit: float
    """Largest magnitude of the quantity, at which it saturates, in its unit."""
    meaning: str
    suffixes: tuple[str, ...] = ()
    """Suffixes of the entries' names; joint numbers where there are none."""


AXES = ("x", "y", "z")
FEATURES = (
    Feature("joint_angle", "rad", 0.3, 10.0, "joint angle minus the start pose's"),
    Feature("joint_velocity", "rad/s", 2.0, 100.0, "joint velocity"),
    Feature("current", "A", 5.0, 500.0, "armature current"),
    Feature("hand_error", "m", 0.5, 10.0, "hand minus target, along x, y, z", AXES),
    Feature("hand_position", "m", 0.5, 10.0, "hand minus the circle's centre, along x, y, z", AXES),
    Feature("lookahead_error", "m", 0.5, 10.0, "hand minus the target 0.1 s later, along x, y, z", AXES),
    Feature("target_angle", "-", 1.0, 1.0, "cosine and sine of the target's angle on the circle", ("cos", "sin")),
)
SWITCHED_FEATURES = (
    Feature("contact_force", "N", 5.0, 1e4, "the table's normal force, joints 3 to n and the hand"),
    Feature("temperature_rise", "K", 50.0, 1e4, "temperature of the windings above the ambient"),
    Feature("pending_voltage", "V", 24.0, 1e4, "voltages still on their way, newest first"),
)
"""Features behind the others, in environments where they are switched on."""
TASK_FEATURES = (
    Feature(
        "further_error",
        "m",
        0.5,
        10.0,
        "hand minus the target 0.3, 0.6 and 1.2 s later, along x, y, z",
        tuple(f"{LOOKAHEAD * times:.1f}s_{axis}" for times in FURTHER for axis in AXES),
    ),
    Feature("target_velocity", "m/s", 0.2, 100.0, "velocity of the target, along x, y, z", AXES),
    Feature("circle_radius", "m", 0.1, 10.0, "radius of the circle", ("",)),
    Feature("angular_velocity", "rad/s", 1.0, 1000.0, "rate of the target's angle, negative if clockwise", ("",)),
    Feature("plane_normal", "-", 1.0, 1.0, "normal of the circle's plane, about which the angle grows", AXES),
    Feature("payload", "kg", 0.1, 100.0, "mass at the hand", ("",)),
    Feature("time_left", "-", 1.0, 1.0, "share of the episode that is left", ("",)),
)
"""Features at the end, in environments whose task is observed."""


def task_columns(num_envs: int, horizon: int | None) -> Array:
    """The kernel's columns of what B arms are to do, zero but for the length of an episode.

    Args:
        num_envs: B, the number of arms.
        horizon: control periods in an episode where the task is observed, None where it is not.
    """
    columns = np.zeros((num_envs, TASK_COLUMNS if horizon is None else OBSERVED_TASK_COLUMNS))
    if horizon is not None:
        columns[:, HORIZON] = horizon
    return columns


@dataclass(frozen=True)
class ObservationLayout:
    """Names, units, scales and bounds of the observation of an arm with `n_joints` joints."""

    n_joints: int
    switched: Mapping[str, int] = field(default_factory=dict[str, int])
    """Number of entries of each switched feature; zero where it is missing."""
    task: bool = False
    """Whether the task is observed, as `TASK_FEATURES` have it."""

    @cached_property
    def features(self) -> tuple[Feature, ...]:
        """Features of the observation, in order."""
        switched = (feature for feature in SWITCHED_FEATURES if self.switched.get(feature.name))
        return (*FEATURES, *switched, *(TASK_FEATURES if self.task else ()))

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Number of entries of each feature."""
        return tuple(self.switched.get(f.name, len(f.suffixes) or self.n_joints) for f in self.features)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Slice of the observation by feature name."""
        ends = np.cumsum(self.sizes)
        return {
            f.name: slice(int(end) - size, int(end))
            for f, size, end in zip(self.features, self.sizes, ends, strict=True)
        }

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """First entry of each of `FEATURES`, (7,), and of `TASK_FEATURES` where the task is observed, (8,)."""
        first = (*FEATURES, *(TASK_FEATURES[:1] if self.task else ()))
        return np.array([self.slices[feature.name].start for feature in first], dtype=np.int64)

    @cached_property
    def noisy(self) -> NDArray[np.int64]:
        """Entries that have the sensors' noise: all that rest on what is measured of joints and hand."""
        measured = [feature.name for feature in FEATURES if feature.name != "target_angle"]
        measured += ["further_error"] if self.task else []
        return np.concatenate([np.arange(self.size)[self.slices[name]] for name in measured])

    @property
    def size(self) -> int:
        """Number of entries of the observation."""
        return sum(self.sizes)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """One name per entry, with its unit: `joint_angle_1 [rad]`, `hand_error_x [m]`, `circle_radius [m]`."""
        n = self.n_joints
        suffixes = {
            "contact_force": (*range(3, n + 1), "hand"),
            "pending_voltage": [f"{1 + k // n}_{1 + k % n}" for k in range(self.switched.get("pending_voltage", 0))],
        }
        return tuple(
            f"{f.name}{suffix and '_'}{suffix} [{f.unit}]"
            for f in self.features
            for suffix in suffixes.get(f.name, f.suffixes or range(1, n + 1))
        )

    @cached_property
    def scale(self) -> Array:
        """Quantity per unit of each entry, in the entry's SI unit."""
        return np.repeat([f.scale for f in self.features], self.sizes)

    @cached_property
    def high(self) -> NDArray[np.float32]:
        """Upper bounds of the scaled entries; the lower ones are their negatives."""
        return np.repeat([f.limit / f.scale for f in self.features], self.sizes).astype(np.float32)

    def decode(self, observation: ArrayLike) -> dict[str, Array]:
        """The quantities in SI units, by feature name, each (..., size)."""
        quantities = np.asarray(observation, dtype=np.float64) * self.scale
        return {name: quantities[..., where] for name, where in self.slices.items()}

"""What an agent sees and what it is paid: pure functions of (B, ...) arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elbow_gym import kernel
from elbow_gym.parameters import Array
from elbow_gym.simulator import Simulator

OBSERVATION_VERSION = 1
LOOKAHEAD = 0.1
"""How far ahead of time the look-ahead error sees the target [s]."""


class Feature(NamedTuple):
    """A group of observation entries of one kind."""

    name: str
    unit: str
    scale: float
    """An entry of the observation is the quantity divided by this."""
    limit: float
    """The quantity saturates here."""
    meaning: str


FEATURES = (
    Feature("joint_angle", "rad", 0.3, 10.0, "joint angle minus the start pose's"),
    Feature("joint_velocity", "rad/s", 2.0, 100.0, "joint velocity"),
    Feature("current", "A", 5.0, 500.0, "armature current"),
    Feature("hand_error", "m", 0.5, 10.0, "hand minus target, along x, y, z"),
    Feature("hand_position", "m", 0.5, 10.0, "hand minus the circle's centre, along x, y, z"),
    Feature("lookahead_error", "m", 0.5, 10.0, "hand minus the target 0.1 s later, along x, y, z"),
    Feature("target_angle", "-", 1.0, 1.0, "cosine and sine of the target's angle on the circle"),
)


@dataclass(frozen=True)
class ObservationLayout:
    """Names, units, scales and bounds of the observation of an arm with `n_joints` joints."""

    n_joints: int

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Entries of each feature."""
        per_joint = {"joint_angle", "joint_velocity", "current"}
        return tuple(self.n_joints if f.name in per_joint else 2 if f.name == "target_angle" else 3 for f in FEATURES)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Where each feature stands in the observation."""
        ends = np.cumsum(self.sizes)
        return {
            f.name: slice(int(end) - size, int(end)) for f, size, end in zip(FEATURES, self.sizes, ends, strict=True)
        }

    @property
    def size(self) -> int:
        """Entries of the observation."""
        return sum(self.sizes)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """One name per entry, with its unit: `joint_angle_1 [rad]`, `hand_error_x [m]`."""
        suffixes = {3: "xyz", 2: ("cos", "sin")}
        return tuple(
            f"{f.name}_{suffix} [{f.unit}]"
            for f, size in zip(FEATURES, self.sizes, strict=True)
            for suffix in (range(1, size + 1) if f.unit in ("rad", "rad/s", "A") else suffixes[size])
        )

    @cached_property
    def scale(self) -> Array:
        """Quantity per unit of each entry, in the entry's SI unit."""
        return np.repeat([f.scale for f in FEATURES], self.sizes)

    @cached_property
    def high(self) -> NDArray[np.float32]:
        """Upper bounds of the scaled entries; the lower ones are their negatives."""
        return np.repeat([f.limit / f.scale for f in FEATURES], self.sizes).astype(np.float32)

    def decode(self, observation: ArrayLike) -> dict[str, Array]:
        """The quantities in SI units, by feature name, each (..., size)."""
        quantities = np.asarray(observation, dtype=np.float64) * self.scale
        return {name: quantities[..., where] for name, where in self.slices.items()}


class Sight(NamedTuple):
    """What is seen of B arms at an instant."""

    observation: NDArray[np.float32]
    """(B, size), scaled and saturated."""
    tracking_error: Array
    """Distance of the hand from the target [m], (B,)."""
    electrical_energy: Array
    """Sum over the joints since the reset [J], (B,); signed."""
    drawn_energy: Array
    """The same of the positive power alone [J], (B,)."""
    link_work: Array
    """Sum over the joints since the reset [J], (B,)."""
    below_table: Array
    """Time under the table since the reset [s], (B,)."""


def look(
    layout: ObservationLayout, simulator: Simulator, pose: Array, path: Array, angle: Array, lookahead: float
) -> Sight:
    """The observation of every arm and the figures that its reward is made of.

    Args:
        layout: the observation's entries.
        simulator: the arms.
        pose: what joint angles are counted from [rad], (n,).
        path: each arm's target path as Fourier rows [m], (B, rows, 3).
        angle: where each target stands on its path [rad], (B,).
        lookahead: angle between the target and the look-ahead target [rad].
    """
    arms = simulator.num_envs
    seen, figures = np.empty((arms, layout.size), np.float32), np.empty((len(kernel.FIGURES), arms))
    kernel.observe(*simulator.raw, pose, path, angle, lookahead, layout.scale, layout.high, seen, figures)
    return Sight(seen, *figures)


def reward_terms(error: Array, power: Array, tracking_weight: float, energy_weight: float) -> tuple[Array, Array]:
    """The two terms of the reward, each (B,): -tracking_weight |hand - target| and -energy_weight P.

    Args:
        error: tracking error at the end of the control step [m].
        power: mean electrical power over it [W].
        tracking_weight: [1/m].
        energy_weight: [1/W].
    """
    return -tracking_weight * error, -energy_weight * power

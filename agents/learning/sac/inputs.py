"""Inputs of the critics beside the observation: errors of the hand to come, and the lengths of errors."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from numpy.typing import ArrayLike
from torch import Tensor
from torch.nn import functional

from elbow_gym.parameters import ArmParameters
from elbow_gym.task.observation import LOOKAHEAD, ObservationLayout

STRETCH = 50.0
"""Inverse of the scaled error around which `Sharpened` enlarges smaller ones and shrinks larger ones [-]."""
GAIN = 3.0
"""Factor of all inputs of the networks [-]; larger inputs let a network bend more sharply."""
AHEAD = (0.05, 0.1, 0.2)
"""Times ahead at which the critics get the error that the hand would have [s]."""
VELOCITY_SCALE = 2.5
"""Scale of the hand's velocity relative to the target [m/s]."""


class Sharpened:
    """The observation with the lengths and the stretched entries of some vectors in it, all times `GAIN`.

    Args:
        n_observations: length of the observation [-].
        vectors: places of vectors in it whose length costs, such as an error. The value has the tip of a cone where
            one of them vanishes, which a network of some hundred units rounds off by centimetres.
    """

    def __init__(self, n_observations: int, vectors: Iterable[slice] = ()) -> None:
        self.vectors = tuple(vectors)
        self.size = n_observations + sum(1 + vector.stop - vector.start for vector in self.vectors)
        """Length of the output vector [-]."""

    def __call__(self, observation: Tensor) -> Tensor:
        """Inputs of the networks [-], shape (B, size), from observations [-], shape (B, n_observations)."""
        vectors = [observation[:, vector] for vector in self.vectors]
        lengths = [vector.norm(dim=1, keepdim=True) for vector in vectors]
        stretched = [0.5 * torch.asinh(STRETCH * vector) for vector in vectors]
        return GAIN * torch.cat((observation, *lengths, *stretched), dim=1)


class Foresight:
    """`Sharpened` errors of the hand: now, against the look-ahead target, and at the times `AHEAD`.

    The errors ahead are those of a hand and a target that keep their velocities. The value of an action depends on
    them, and has its tip where they vanish: at a velocity of the hand that a network would have to work out from ten
    joint rates.

    Args:
        layout: layout of the observation.
        arm: arm of n joints that the hand belongs to.
        pose: joint angles at which the observation's are zero [rad], shape (n,).
    """

    def __init__(self, layout: ObservationLayout, arm: ArmParameters, pose: ArrayLike) -> None:
        self.length = torch.as_tensor(arm.of_links("length"), dtype=torch.float32)
        self.pose = torch.as_tensor(pose, dtype=torch.float32)
        self._slices = layout.slices
        self._scale = {feature.name: feature.scale for feature in layout.features}
        errors = [layout.slices[name] for name in ("hand_error", "lookahead_error")]
        errors += [slice(layout.size + 3 * k, layout.size + 3 * (k + 1)) for k in range(len(AHEAD))]
        self.sharpened = Sharpened(layout.size + 3 * (len(AHEAD) + 1), errors)
        self.size = self.sharpened.size
        """Length of the output vector [-]."""

    def __call__(self, observation: Tensor) -> Tensor:
        """Inputs of the networks [-], shape (B, size), from observations [-], shape (B, layout.size)."""
        error, velocity = self._read(observation, "hand_error"), self.velocity(observation)
        ahead = [(error + time * velocity) / self._scale["hand_error"] for time in AHEAD]
        return self.sharpened(torch.cat((observation, *ahead, velocity / VELOCITY_SCALE), dim=1))

    def velocity(self, observation: Tensor) -> Tensor:
        """Velocity of the hand less the target's mean velocity over the look-ahead time [m/s], shape (B, 3).

        Args:
            observation: observations of B arms [-], shape (B, layout.size).
        """
        q, q_dot = self._read(observation, "joint_angle") + self.pose, self._read(observation, "joint_velocity")
        # Joint 1 is the yaw; link 1 stands upright.
        pitch, pitch_rate = (functional.pad(joints[:, 1:].cumsum(1), (1, 0)) for joints in (q, q_dot))
        flat, upright = self.length * pitch.sin(), self.length * pitch.cos()
        reach, reach_rate = flat.sum(1), (upright * pitch_rate).sum(1)
        sine, cosine, yaw_rate = q[:, 0].sin(), q[:, 0].cos(), q_dot[:, 0]
        hand = (
            reach_rate * cosine - reach * sine * yaw_rate,
            reach_rate * sine + reach * cosine * yaw_rate,
            -(flat * pitch_rate).sum(1),
        )
        way = self._read(observation, "hand_error") - self._read(observation, "lookahead_error")
        return torch.stack(hand, dim=1) - way / LOOKAHEAD

    def _read(self, observation: Tensor, name: str) -> Tensor:
        """A feature in SI units, shape (B, entries)."""
        return observation[:, self._slices[name]] * self._scale[name]

"""What critics are shown besides the observation: where the hand is heading, and how long errors are."""

from __future__ import annotations

from collections.abc import Iterable

import torch
from numpy.typing import ArrayLike
from torch import Tensor
from torch.nn import functional

from elbow_gym.parameters import ArmParameters
from elbow_gym.task.observation import LOOKAHEAD, ObservationLayout

STRETCH = 50.0
"""Values far below its inverse are made larger, far above it smaller."""
GAIN = 3.0
"""Of all that the networks see: larger inputs let them bend more sharply."""
AHEAD = (0.05, 0.1, 0.2)
"""Times at which the critics see where the hand would be [s]."""
VELOCITY_SCALE = 2.5
"""Of the hand against the target [m/s]."""


class Sharpened:
    """The observation, and of some parts of it the length and the stretched entries, all times `GAIN`.

    Args:
        n_observations: entries of the observation.
        vectors: where parts stand whose length costs, such as an error. The value has a cone's tip where one vanishes,
            which a network of some hundred units rounds off by centimetres.
    """

    def __init__(self, n_observations: int, vectors: Iterable[slice] = ()) -> None:
        self.vectors = tuple(vectors)
        self.size = n_observations + sum(1 + vector.stop - vector.start for vector in self.vectors)
        """Of what it gives."""

    def __call__(self, observation: Tensor) -> Tensor:
        """From (B, n_observations) to (B, size)."""
        vectors = [observation[:, vector] for vector in self.vectors]
        lengths = [vector.norm(dim=1, keepdim=True) for vector in vectors]
        stretched = [0.5 * torch.asinh(STRETCH * vector) for vector in vectors]
        return GAIN * torch.cat((observation, *lengths, *stretched), dim=1)


class Foresight:
    """`Sharpened` errors of the hand: now, at the look-ahead target, and if hand and target went on as they do.

    What an action is worth shows in the errors to come, and the tip of the value lies where those vanish, at a hand's
    velocity that a network would have to work out from ten joint rates.

    Args:
        layout: of the observation.
        arm: whose hand it is.
        pose: what the observation's joint angles are counted from [rad], (n,).
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
        """Of what it gives."""

    def __call__(self, observation: Tensor) -> Tensor:
        """From the observations of B arms to (B, size)."""
        error, velocity = self._read(observation, "hand_error"), self.velocity(observation)
        ahead = [(error + time * velocity) / self._scale["hand_error"] for time in AHEAD]
        return self.sharpened(torch.cat((observation, *ahead, velocity / VELOCITY_SCALE), dim=1))

    def velocity(self, observation: Tensor) -> Tensor:
        """Of the hand less the target's mean one over the look-ahead time [m/s], (B, 3)."""
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
        return observation[:, self._slices[name]] * self._scale[name]

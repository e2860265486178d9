"""PD controller of the paper (eqs 27-29), which reads the observation alone."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from elbow_gym.checks import positive
from elbow_gym.env import ElbowArmEnv
from elbow_gym.kinematics import HandPlacement
from elbow_gym.vector_env import ElbowArmVectorEnv

PAPER_KP = 500.0
PAPER_KD = 20.0
# Arguments of the environments that the PD acts in. Unclipped it peaks at 377 V, well within the limit.
UNLIMITED: dict[str, Any] = {
    "control_frequency": 10_000.0,
    "voltage_limit": 1000.0,
    "action_unit": "volt",
}
CLIPPED: dict[str, Any] = {"control_frequency": 2000.0, "voltage_limit": 24.0, "action_unit": "volt"}


class PDController:
    """v = kp (q_d - q) + kd (q_d_dot - q_dot) on every joint (eq. 27), in volts, then in the action's unit.

    q_d keeps the start pose but for joints 1, n-1 and n, which put the hand on the target (eq. 29); q_d_dot is its
    exact derivative. The control is stable at 2 kHz, as with the environment's arguments `CLIPPED`, not at 1 kHz.

    Args:
        env: the environment that it will act in, single or batched.
        kp: proportional gain [V/rad].
        kd: derivative gain [V s/rad].

    Raises:
        ValueError: the circle is out of reach of joints 1, n-1 and n; the message has the distance missing.
    """

    def __init__(self, env: ElbowArmEnv | ElbowArmVectorEnv, kp: float = PAPER_KP, kd: float = PAPER_KD) -> None:
        self.kp, self.kd = positive("kp", kp), positive("kd", kd)
        episodes = cast("ElbowArmEnv | ElbowArmVectorEnv", env.unwrapped).episodes
        # A drawn circle is another one in each episode.
        self._layout, self._circle = episodes.layout, episodes.targets if episodes.circle.random else episodes.circle
        self._pose, self._placement = episodes.pose, HandPlacement(episodes.arm, episodes.pose)
        self._volts, self._highest = episodes.volts_per_action, episodes.highest_action
        if not episodes.circle.random:
            self.desired(np.linspace(0.0, 2.0 * np.pi, 73))

    def desired(self, angle: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """q_d [rad] and q_d_dot [rad/s], each (..., n), for the target's angle on the circle [rad], (...).

        Where circles are drawn, one angle per arm, (B,).
        """
        return self._placement.joints(self._circle.position(angle), self._circle.velocity(angle))

    def predict(
        self, observation: NDArray[np.float32], *_args: Any, **_kwargs: Any
    ) -> tuple[NDArray[np.float32], None]:
        """Actions (..., n) for observations (..., size)."""
        seen = self._layout.decode(observation)
        cosine, sine = seen["target_angle"][..., 0], seen["target_angle"][..., 1]
        q_d, q_d_dot = self.desired(np.arctan2(sine, cosine))
        voltage = self.kp * (q_d - self._pose - seen["joint_angle"]) + self.kd * (q_d_dot - seen["joint_velocity"])
        action = np.minimum(np.maximum(voltage / self._volts, -self._highest), self._highest)
        return action.astype(np.float32), None

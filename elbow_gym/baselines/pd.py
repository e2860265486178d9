"""PD controller of the paper (eqs 27-29), which reads the observation alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elbow_gym.checks import positive
from elbow_gym.interface import Environment, Interface
from elbow_gym.kinematics import HandPlacement, nearest_turn

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

    q_d keeps one pose but for joints 1, n-1 and n, which put the hand on the target (eq. 29), joints 1 and n-1 by
    the turn nearest to where they are; q_d_dot is its exact derivative. On the paper's arm the control is stable at
    2 kHz, as with the environment's arguments `CLIPPED`, not at 1 kHz.

    Args:
        env: the environment that it will act in, single or batched, wrapped or not.
        kp: proportional gain [V/rad].
        kd: derivative gain [V s/rad].
        pose: angles that joints 2..n-2 keep [rad], (n,); the start pose when None.

    Raises:
        ValueError: env is another environment, a gain is not positive, or the circle is out of reach of joints 1, n-1
            and n; that message has the distance missing.
    """

    def __init__(
        self, env: Environment, kp: float = PAPER_KP, kd: float = PAPER_KD, pose: ArrayLike | None = None
    ) -> None:
        self.kp, self.kd = positive("kp", kp), positive("kd", kd)
        self._interface = interface = Interface(env)
        self._placement = HandPlacement(interface.arm, interface.pose if pose is None else pose)
        # A drawn circle is another one in each episode.
        if not interface.circle.random:
            self.desired(np.linspace(0.0, 2.0 * np.pi, 73))

    def desired(self, angle: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """q_d [rad] and q_d_dot [rad/s], each (..., n), for the target's angle on the circle [rad], (...).

        Where circles are drawn, one angle per arm, (B,).
        """
        return self._placement.joints(*self._interface.target(angle))

    def predict(
        self, observation: NDArray[np.float32], *_args: Any, **_kwargs: Any
    ) -> tuple[NDArray[np.float32], None]:
        """Actions (..., n) for observations (..., size)."""
        interface = self._interface
        observed = interface.decode(observation)
        q_d, q_d_dot = self.desired(interface.target_angle(observed))
        q_d = nearest_turn(q_d, interface.pose + observed["joint_angle"])
        lag = q_d - interface.pose - observed["joint_angle"]
        return interface.action(self.kp * lag + self.kd * (q_d_dot - observed["joint_velocity"])), None

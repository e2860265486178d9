"""Interface of the environments to controllers: parts of observations, actions from volts, rates, arm and target."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import ArrayLike, NDArray

from elbow_gym.env import ElbowArmEnv
from elbow_gym.parameters import Array
from elbow_gym.vector_env import ElbowArmVectorEnv

Environment = gym.Env[Any, Any] | VectorEnv[Any, Any, Any]


class Interface:
    """An environment as a controller needs it, single or batched.

    Observations and actions are those of the environment itself, before a wrapper changes them.

    Args:
        env: an `ElbowArmEnv` or an `ElbowArmVectorEnv`, wrapped or not.

    Raises:
        ValueError: env is another environment.
    """

    def __init__(self, env: Environment) -> None:
        inner: Any = getattr(env, "unwrapped", None)
        if not isinstance(inner, ElbowArmEnv | ElbowArmVectorEnv):
            raise ValueError(f"env must be an ElbowArmEnv or ElbowArmVectorEnv, wrapped or not, got {env!r}")
        episodes = inner.episodes
        self.settings = episodes.settings
        """Arguments that the environment was made with."""
        self.arm = episodes.arm
        """Nominal parameters of the arm."""
        self.elbows = episodes.settings.elbow_joints
        """Numbers of the joints held on the table, ascending."""
        self.pose = episodes.pose
        """Start pose [rad], (n,), from which observed joint angles count."""
        self.layout = episodes.layout
        """Names, units, scales and places of the observation's entries."""
        self.circle = episodes.circle
        """Path of the target; with ranges, where it is drawn anew at each reset."""
        self.control_period = episodes.settings.control_period
        """Time between two actions [s]."""
        self.substeps = episodes.settings.substeps
        """Lengths of the simulator's steps in a control period [s]."""
        self.horizon = episodes.horizon
        """Number of control periods in an episode."""
        self.voltage_limit = float(episodes.settings.voltage_limit)
        """Nominal supply voltage of every motor [V]."""
        self.highest_action = episodes.highest_action
        """Largest entry of an action, in the action's unit."""
        self._volts = episodes.volts_per_action
        self._targets, self._single = episodes.targets, isinstance(inner, ElbowArmEnv)

    def decode(self, observation: NDArray[np.float32]) -> dict[str, Array]:
        """Quantities of observations (..., size) in SI units, each (..., entries), by feature name."""
        return self.layout.decode(observation)

    def joint_angles(self, observed: dict[str, Array]) -> Array:
        """Joint angles q [rad], (..., n), from a decoded observation."""
        return observed["joint_angle"] + self.pose

    def target_angle(self, observed: dict[str, Array]) -> Array:
        """Angle of the target on its path [rad], (...), within half a turn, from a decoded observation."""
        return np.arctan2(observed["target_angle"][..., 1], observed["target_angle"][..., 0])

    def target(self, angle: ArrayLike) -> tuple[Array, Array]:
        """Position [m] and velocity [m/s] of the target, each (..., 3), at angles on its path [rad], (...).

        In a batch whose circles are drawn, each arm has its own: the angles are (..., B).
        """
        angle = np.asarray(angle, dtype=np.float64)
        if not self.circle.random:
            return self.circle.position(angle), self.circle.velocity(angle)
        rows = angle.reshape(-1, len(self._targets.circles))
        position = np.stack([self._targets.position(row) for row in rows])
        velocity = np.stack([self._targets.velocity(row) for row in rows])
        return position.reshape(*angle.shape, 3), velocity.reshape(*angle.shape, 3)

    @property
    def target_rate(self) -> float | Array:
        """Signed rate of the target's angle [rad/s]; (B,) in a batch whose circles are drawn."""
        if not self.circle.random:
            return self.circle.rate
        return float(self._targets.rate[0]) if self._single else self._targets.rate

    def action(self, voltage: ArrayLike) -> NDArray[np.float32]:
        """Action in the environment's unit, (..., n), that asks for terminal voltages [V], clipped to the supply."""
        highest = self.highest_action
        return np.minimum(np.maximum(np.asarray(voltage) / self._volts, -highest), highest).astype(np.float32)

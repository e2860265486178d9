"""Base of the planners: state and targets ahead from observations, and the model that plans are made with.

A planner is told what policies are told: the observation, and as computed torque the arm's nominal parameters, the path
and the prices. It plans for the nominal arm, whatever was drawn, without payload or with the one that it estimates.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.control.inverse_dynamics import InverseDynamics
from agents.planning.payload import PayloadEstimate
from agents.planning.tail import Tail
from elbow_gym.checks import positive
from elbow_gym.interface import Environment, Interface
from elbow_gym.kinematics import constraint_jacobian, on_table

Array = NDArray[np.float64]


class View(NamedTuple):
    """State and model of one arm, and its targets ahead."""

    state: dict[str, Array]
    """q [rad], q_dot [rad/s] and current [A], each (n,), with the elbows at z = 0."""
    angle: float
    """Angle of the target on its path [rad]."""
    target: Array
    """Targets at the ends of the control periods ahead [m], (N, 3)."""
    velocity: Array
    """Their velocities [m/s], (N, 3)."""
    inverse: InverseDynamics
    """Motion equations of the arm with the payload that it is taken to carry."""


class Planner(ABC):
    """Controller that plans anew in every control period, arm by arm, and carries out the plan's first voltages.

    It keeps each arm's last plan: make one for each episode.

    Args:
        env: the environment that it will act in, single or batched.
        horizon: time that plans look ahead [s].
        resting: time behind a plan in which the arm is taken to rest [s].
        braking: time in which the hand is taken to be braked at a plan's end [s].
        seen: time that the targets are known ahead, if more [s].
        estimate_payload: whether the payload is estimated from the motion; otherwise there is taken to be none.
    """

    def __init__(
        self,
        env: Environment,
        horizon: float,
        resting: float,
        braking: float,
        seen: float = 0.0,
        estimate_payload: bool = False,
    ) -> None:
        self.interface = interface = Interface(env)
        period = interface.control_period
        self.periods = max(1, round(positive("horizon", horizon) / period))
        """Control periods of a plan."""
        self._seen = max(self.periods, round(seen / period))
        self.settings = replace(
            interface.settings,
            start_noise=0.0,
            payload=0.0,
            randomize=None,
            circle=interface.circle.widest,
            # One period more, so that a plan ends before the episode.
            duration=(self.periods + 1) * period,
        )
        """Arguments of an environment for the model: the nominal arm without load and noise."""
        self.inverse = InverseDynamics(interface.arm, interface.elbows)
        self._estimating = estimate_payload
        self._estimates: dict[int, PayloadEstimate] = {}
        self._last: dict[int, tuple[dict[str, Array], Array]] = {}
        self.tail = Tail(self.inverse, period, positive("resting", resting), positive("braking", braking))

    def predict(
        self, observation: NDArray[np.float32], *_args: Any, **_kwargs: Any
    ) -> tuple[NDArray[np.float32], None]:
        """Actions (..., n) for observations (..., size); the first call is the episode's start."""
        views = self._views(np.atleast_2d(observation))
        voltage = np.stack([self._decide(arm, view) for arm, view in enumerate(views)])
        self._last = {arm: (view.state, voltage[arm]) for arm, view in enumerate(views)}
        return self.interface.action(voltage.reshape(*observation.shape[:-1], -1)), None

    @abstractmethod
    def _decide(self, arm: int, view: View) -> Array:
        """Voltages of the next control period [V], (n,), of an arm of the batch."""

    def _views(self, observation: NDArray[np.float32]) -> list[View]:
        interface = self.interface
        observed = interface.decode(observation)
        angle = interface.target_angle(observed)
        ahead = interface.control_period * np.arange(1, self._seen + 1)
        turns = np.multiply.outer(ahead, np.broadcast_to(interface.target_rate, angle.shape))
        target, velocity = interface.target(angle + turns)
        states = zip(interface.joint_angles(observed), observed["joint_velocity"], observed["current"], strict=True)
        return [
            View(state, float(angle[i]), target[:, i], velocity[:, i], self._model(i, state))
            for i, state in enumerate(self._held(*state) for state in states)
        ]

    def _model(self, arm: int, state: dict[str, Array]) -> InverseDynamics:
        """Motion equations of an arm of the batch that has come into a state."""
        if not self._estimating or arm not in self._last:
            return self.inverse
        before, voltage = self._last[arm]
        limit = self.interface.voltage_limit
        estimate = self._estimates.setdefault(arm, PayloadEstimate(self.inverse, self.interface.control_period))
        return self.inverse.loaded(estimate.update(before, np.clip(voltage, -limit, limit), state))

    def _held(self, q: Array, q_dot: Array, current: Array) -> dict[str, Array]:
        """The nearest state that keeps the elbows on the table, which rounding to float32 lifts by micrometres."""
        arm, elbows = self.interface.arm, self.interface.elbows
        q = on_table(arm, q, elbows)
        if elbows:
            jacobian = constraint_jacobian(arm, q, elbows)
            q_dot = q_dot - np.linalg.pinv(jacobian) @ (jacobian @ q_dot)
        return {"q": q, "q_dot": q_dot, "current": current}


def shifted(plan: Array) -> Array:
    """A plan (N, ...) one control period later, its last entry held."""
    return np.concatenate([plan[1:], plan[-1:]])

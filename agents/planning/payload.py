"""Payload of an arm that nobody tells, from what its motors did: least squares over the control periods so far."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from agents.control.inverse_dynamics import InverseDynamics
from elbow_gym.kinematics import constraint_jacobian

Array = NDArray[np.float64]

KEPT = 0.98
"""Weight of a control period, as a share of the next one's [-]."""
DOUBT = 0.01
"""Weight of the assumption that there is no payload: the square of the torque that a kilogram would need [(N m/kg)^2].
Where the arm is weightless and at rest, nothing else says anything."""


class PayloadEstimate:
    """Estimate of one arm's payload.

    The charge that went through a motor in a control period under a held voltage is exactly
    (v h - K_m dq - L di) / R, so that its mean torque is known, as are the motion's mean rates and accelerations. What
    it exceeds the torque of the arm without payload by, apart from what the elbows' forces may be, is the payload's.

    Args:
        inverse: motion equations of the arm without payload.
        period: length of a control period [s].
    """

    def __init__(self, inverse: InverseDynamics, period: float) -> None:
        self._bare, self._loaded, self._period = inverse, inverse.loaded(1.0), period
        self._heaviest = float(inverse.arm.of_links("mass").sum())
        self._squares, self._products = 0.0, 0.0

    def update(self, before: Mapping[str, Array], voltage: Array, after: Mapping[str, Array]) -> float:
        """The payload [kg] after one more control period; from zero to the arm's own mass.

        Args:
            before: q [rad], q_dot [rad/s] and current [A], each (n,), at the period's start.
            voltage: terminal voltages that were held [V], (n,).
            after: the same at its end.
        """
        bare, h = self._bare, self._period
        q, q_dot, current = (np.stack([before[name], after[name]]) for name in ("q", "q_dot", "current"))
        # Means, because friction and back-EMF are linear in the rates: fast links settle long before a period's middle.
        pose, rate, acceleration = q.mean(axis=0), (q[1] - q[0]) / h, (q_dot[1] - q_dot[0]) / h
        lost = bare.voltage(rate, 0.0, (current[1] - current[0]) / h)
        torque = bare.torque_constant * (voltage - lost) / bare.resistance
        needed = bare.torque(pose, rate, acceleration)
        slope, share = self._loaded.torque(pose, rate, acceleration) - needed, torque - needed
        if bare.elbows:
            # The directions in which the elbows' forces act say nothing.
            jacobian = constraint_jacobian(bare.arm, pose, bare.elbows)
            share = share - np.linalg.pinv(jacobian) @ (jacobian @ share)
            slope = slope - np.linalg.pinv(jacobian) @ (jacobian @ slope)
        self._squares = KEPT * self._squares + float(slope @ slope)
        self._products = KEPT * self._products + float(slope @ share)
        return float(np.clip(self._products / (self._squares + DOUBT), 0.0, self._heaviest))

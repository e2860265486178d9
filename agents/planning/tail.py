"""Terminal cost of a plan: the arm is taken to rest in its last pose for a while, as far from the target as then.

What rests pays the copper loss of its posture, so that a plan of less than a second knows that postures differ. The
hand's distance is taken a moment later, when what moves at the end of the plan has been braked.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.control.inverse_dynamics import InverseDynamics
from agents.planning.points import hand
from agents.planning.sparse import casadi
from elbow_gym.kinematics import hand_position

Array = NDArray[np.float64]


class Written(NamedTuple):
    """CasADi functions of the last point z, target, velocity, smoothing, tracking weight, energy weight and payload."""

    cost: Any
    slope: Any
    hessian: Any
    """Entries of the Hessian's upper triangle."""
    hessian_sparsity: Any


SPEED = 0.02
"""Price of a joint's rate at a plan's end [s^2/rad^2], without which a plan throws the arm into a cheap last pose."""


@dataclass(frozen=True)
class Tail:
    """Cost of the time after a plan, in units of the return."""

    inverse: InverseDynamics
    """Motion equations of the arm."""
    control_period: float
    """Time between two actions [s]."""
    duration: float
    """Time that the arm is taken to rest in the last pose [s]."""
    braking: float
    """Time that the hand is taken to go on as it moves at the plan's end [s]."""

    def cost(
        self, q: Array, q_dot: Array, target: Array, velocity: Array, tracking_weight: float, energy_weight: float
    ) -> Array:
        """Negative return of the time after a plan, (...).

        Args:
            q: joint angles at its end [rad], (..., n).
            q_dot: their rates [rad/s], (..., n).
            target: target then [m], (3,).
            velocity: the target's velocity [m/s], (3,).
            tracking_weight: cost per metre [1/m].
            energy_weight: cost per watt [1/W].
        """
        inverse, ahead = self.inverse, target + self.braking * velocity
        error = np.linalg.norm(hand_position(inverse.arm, q + self.braking * q_dot) - ahead, axis=-1)
        power = (inverse.resistance * inverse.hold(q).current ** 2).sum(axis=-1)
        thrown = SPEED * (q_dot**2).sum(axis=-1)
        periods = self.duration / self.control_period
        return periods * (tracking_weight * error + energy_weight * power) + thrown

    def written(self, size: int) -> Written:
        """`cost` for CasADi, with the smoothed error sqrt(e^2 + smoothing^2).

        Args:
            size: length of a collocation point's variables, of which q and q_dot are the first.
        """
        ca = casadi()
        payload = ca.SX.sym("payload")
        inverse = self.inverse.loaded(payload)
        n, p = inverse.arm.n_joints, len(inverse.elbows)
        z, target, velocity = ca.SX.sym("z", size), ca.SX.sym("target", 3), ca.SX.sym("velocity", 3)
        smoothing, tracking, energy = (ca.SX.sym(name) for name in ("smoothing", "tracking", "energy"))
        q, q_dot = z[:n].T, z[n : 2 * n].T
        error = hand(inverse, q + self.braking * q_dot) - target - self.braking * velocity
        # sum R i^2 with the elbow forces of least loss: what remains of the torque without the elbows' part.
        root = ca.DM(np.diag(np.sqrt(inverse.resistance) / inverse.torque_constant))
        held = ca.mtimes(inverse.holding_torque(q), root)
        power = ca.dot(held, held)
        if p:
            unit = ca.vertcat(*(ca.mtimes(inverse.elbow_torque(q, ca.DM(row[None])), root) for row in np.eye(p)))
            along = ca.mtimes(unit, held.T)
            power -= ca.dot(along, ca.solve(ca.mtimes(unit, unit.T), along))
        periods = self.duration / self.control_period
        cost = periods * (tracking * ca.sqrt(ca.dot(error, error) + smoothing**2) + energy * power)
        cost += SPEED * ca.dot(q_dot, q_dot)
        seen = [z, target, velocity, smoothing, tracking, energy, payload]
        hessian = ca.triu(ca.hessian(cost, z)[0])
        return Written(
            ca.Function("tail", seen, [cost]),
            ca.Function("tail_slope", seen, [ca.gradient(cost, z)]),
            ca.Function("tail_hessian", seen, [ca.vertcat(*hessian.nonzeros())]),
            hessian.sparsity(),
        )

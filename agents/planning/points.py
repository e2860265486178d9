"""One collocation point of the program: motion equations as residuals, the smoothed tracking cost, and derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from agents.control.inverse_dynamics import InverseDynamics
from agents.planning.layout import NAMES
from agents.planning.sparse import casadi

SETTLING_TIME = 0.05
"""Time constant with which an elbow's height left by the discretisation decays [s]."""


class Points:
    """CasADi functions of one collocation point: residuals, cost and their derivatives.

    Args:
        inverse: motion equations of the arm, whose payload is an argument of the functions.
        above_table: whether joints 3..n and the hand must have z >= 0.
    """

    def __init__(self, inverse: InverseDynamics, above_table: bool) -> None:
        ca = casadi()
        arm, n, p = inverse.arm, inverse.arm.n_joints, len(inverse.elbows)
        payload = ca.SX.sym("payload")
        inverse = inverse.loaded(payload)
        q, q_dot, q_ddot, current = (ca.SX.sym(name, 1, n) for name in NAMES[:4])
        force = ca.SX.sym(NAMES[4], 1, p)
        z = ca.horzcat(q, q_dot, q_ddot, current, force).T
        length, phi = arm.of_links("length"), ca.mtimes(q, ca.DM(inverse.to_pitch))
        heights = ca.mtimes(ca.cos(phi), ca.DM(np.triu(np.ones((n, n))) * length[:, None]))
        residual = inverse.torque(q, q_dot, q_ddot) - inverse.elbow_torque(q, force)
        residual -= ca.mtimes(current, ca.DM(np.diag(inverse.torque_constant)))
        free = [k for k in range(1, n) if above_table and k + 2 not in inverse.elbows]
        held = inverse.elbow_speeds(q, q_dot) + inverse.elbow_heights(q) / SETTLING_TIME
        conditions = ca.vertcat(residual.T, held.T, *[heights[k] for k in free])
        self.equalities, self.conditions = n + p, n + p + len(free)

        target, smoothing, weight = ca.SX.sym("target", 3), ca.SX.sym("smoothing"), ca.SX.sym("weight")
        error = hand(inverse, q) - target
        cost = weight * ca.sqrt(ca.dot(error, error) + smoothing**2)
        scale, multipliers = ca.SX.sym("scale"), ca.SX.sym("multipliers", self.conditions)
        jacobian = ca.jacobian(conditions, z)
        hessian = ca.triu(ca.hessian(scale * cost + ca.dot(multipliers, conditions), z)[0])
        seen = [z, target, smoothing, weight]
        self.size = z.numel()
        self.residual = ca.Function("residual", [z, payload], [conditions])
        self.cost = ca.Function("cost", seen, [cost])
        self.slope = ca.Function("slope", seen, [ca.gradient(cost, z)])
        self.jacobian = ca.Function("jacobian", [z, payload], [ca.vertcat(*jacobian.nonzeros())])
        self.hessian = ca.Function("hessian", [*seen, payload, scale, multipliers], [ca.vertcat(*hessian.nonzeros())])
        self.jacobian_sparsity, self.hessian_sparsity = jacobian.sparsity(), hessian.sparsity()


def hand(inverse: InverseDynamics, q: Any) -> Any:
    """Symbolic position of the hand [m], (3, 1), at joint angles [rad], (1, n)."""
    ca = casadi()
    length, phi = ca.DM(inverse.arm.of_links("length")), ca.mtimes(q, ca.DM(inverse.to_pitch))
    rho = ca.dot(length, ca.sin(phi).T)
    return ca.vertcat(rho * ca.cos(q[0]), rho * ca.sin(q[0]), ca.dot(length, ca.cos(phi).T))

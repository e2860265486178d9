"""Episode, or a part of one, as a sparse nonlinear program: Radau collocation of arm, motors and elbows.

One control period under held voltages is one element with `degree` Radau points, which are stiffly accurate: the
armature (1.5 ms) and the light links (5 ms) are faster than the period (20 ms). The motion equations are
inverse-dynamics residuals, so that no linear solve enters an expression; the elbows' velocities are held at zero (held
heights, of index 3, have multipliers that swing between the points). Every point's derivatives are one small CasADi
function mapped over all points, the rest is constant. Start, targets, payload and prices are parameters of the program,
so that a planner solves one program in every control period.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.inverse_dynamics import InverseDynamics
from agents.planning.layout import NAMES, STATE, Layout, collocation_rows, power_form
from agents.planning.points import Points
from agents.planning.sparse import casadi, casadi_matrix, lagrange
from agents.planning.tail import Tail
from agents.planning.task import Task
from elbow_gym.kinematics import hand_position

Array = NDArray[np.float64]
Multipliers = tuple[Array, Array]
"""Multipliers of the bounds of the variables and of the conditions."""

SOLVER = {
    "print_level": 0,
    "sb": "yes",
    "linear_solver": "mumps",
    # MUMPS's own permutation and scaling make it put off pivots, which fills the factors: with two points a period an
    # iteration takes three times as long with them.
    "mumps_permuting_scaling": 0,
    "mumps_scaling": 0,
    # Approximate minimum fill: found in a tenth of the time of the default order, with half the factors' time.
    "mumps_pivot_order": 2,
}
"""Options of IPOPT for every solve."""


class Transcription:
    """Program and its solver. Variables: all points one after the other, then the voltages of all periods.

    Args:
        problem: periods to transcribe.
        degree: Radau points in a control period.
        tail: cost behind the last period; none when None.
    """

    def __init__(self, problem: Task, degree: int, tail: Tail | None = None) -> None:
        ca = casadi()
        settings = problem.settings
        self.problem, self.degree = problem, degree
        self.periods, self.period = len(problem.target), settings.control_period
        self.inverse = InverseDynamics(settings.parsed_arm, settings.elbow_joints, settings.payload)
        self.n = settings.parsed_arm.n_joints
        self.points = Points(self.inverse, problem.above_table)
        self.fractions = np.array(ca.collocation_points(degree, "radau"))
        self._derivative = np.array(ca.collocation_coeff(self.fractions.tolist())[0])
        self._weights = np.linalg.inv(self._derivative[1:].T)[-1]
        layout = Layout(self.periods, degree, self.points.size, self.n)
        self._voltages, self.size = layout.voltages, layout.size
        rows, self._of_start = collocation_rows(layout, self.inverse, self.period, self._derivative)
        power, self._power_of_start = power_form(layout, self.inverse, self.period)
        self._solvers: dict[tuple[tuple[str, Any], ...], Any] = {}
        self._write(ca, rows, power, tail)
        rest = np.zeros(self.n)
        self.begin({"q": problem.start, "q_dot": rest, "current": rest}, problem.target)

    def begin(
        self,
        start: Mapping[str, Array],
        target: Array,
        velocity: Array | None = None,
        inverse: InverseDynamics | None = None,
    ) -> None:
        """Sets where the periods start, what the hand is to follow and what it carries.

        Args:
            start: q [rad], q_dot [rad/s] and current [A], each (n,), with the elbows at z = 0.
            target: targets at the ends of the control periods [m], (N, 3).
            velocity: velocity of the last of them [m/s], (3,), for the tail; zero when None.
            inverse: motion equations of the arm with another payload than before; the same when None.
        """
        self.inverse = self.inverse if inverse is None else inverse
        self._start = {name: start[name] for name in STATE}
        self._target, self._velocity = target, np.zeros(3) if velocity is None else velocity
        state = np.concatenate([start[name] for name in STATE])
        right = self._of_start @ state
        self._linear = self._power_of_start @ state
        for side in ("lbg", "ubg"):
            self._bounds[side][-right.size :] = right

    def _write(self, ca: Any, rows: Any, power: Any, tail: Tail | None) -> None:
        from scipy import sparse

        points, count, volts = self.points, self.periods * self.degree, self.periods * self.n
        self._power_form = power + sparse.triu(power, 1).T
        A, P, upper = (casadi_matrix(matrix) for matrix in (rows, self._power_form, power))
        x = ca.MX.sym("x", self.size)
        aims = 3 * self.periods
        parameters = ca.MX.sym("p", 4 + aims + 3 + self.n)
        scale, multipliers = ca.MX.sym("f"), ca.MX.sym("g", count * points.conditions + rows.shape[0])
        smoothing, tracking, energy, payload = ca.vertsplit(parameters[:4])
        loaded = ca.repmat(payload, 1, count)
        Z = ca.reshape(x[: self._voltages], points.size, count)
        # The reward depends on the last point of each period alone.
        last = np.tile(np.arange(self.degree) == self.degree - 1, self.periods).astype(float)
        aim, velocity, first = ca.vertsplit(parameters[4:], np.cumsum([0, aims, 3, self.n]).tolist())
        at = ca.DM(np.repeat(np.eye(self.periods), self.degree, axis=1))
        target = ca.mtimes(ca.reshape(aim, 3, self.periods), at)
        # Of the power's linear part the first period's voltages alone have any.
        p = ca.vertcat(ca.MX.zeros(self._voltages), first, ca.MX.zeros(volts - self.n))
        seen = (Z, target, ca.repmat(smoothing, 1, count), ca.DM(last[None]) * tracking)
        cost = ca.sum2(points.cost.map(count)(*seen)) + energy * (ca.dot(x, ca.mtimes(P, x)) / 2 + ca.dot(p, x))
        slope = ca.vertcat(ca.vec(points.slope.map(count)(*seen)), ca.MX.zeros(volts)) + energy * (ca.mtimes(P, x) + p)
        conditions = ca.vertcat(ca.vec(points.residual.map(count)(Z, loaded)), ca.mtimes(A, x))
        blocks = ca.horzcat(
            ca.diagcat(*[points.jacobian_sparsity] * count), ca.Sparsity(count * points.conditions, volts)
        )
        jacobian = ca.vertcat(ca.MX(blocks, ca.vec(points.jacobian.map(count)(Z, loaded))), ca.MX(A))
        own = ca.reshape(multipliers[: count * points.conditions], points.conditions, count)
        curvature = ca.vec(points.hessian.map(count)(*seen, loaded, ca.repmat(scale, 1, count), own))
        places = ca.diagcat(*[points.hessian_sparsity] * count, ca.Sparsity(volts, volts))
        hessian = ca.MX(places, curvature) + scale * energy * upper
        if tail is not None:
            before, behind = self._voltages - points.size, volts
            of_end = (Z[:, -1], aim[-3:], velocity, smoothing, tracking, energy, payload)
            written = tail.written(points.size)
            cost += written.cost(*of_end)
            slope += ca.vertcat(ca.MX.zeros(before), written.slope(*of_end), ca.MX.zeros(behind))
            block = ca.diagcat(ca.Sparsity(before, before), written.hessian_sparsity, ca.Sparsity(behind, behind))
            hessian += scale * ca.MX(block, written.hessian(*of_end))
        self._program = {"x": x, "p": parameters, "f": cost, "g": conditions}
        inputs = ["x", "p"]
        self._derivatives = {
            "grad_f": ca.Function("nlp_grad_f", [x, parameters], [cost, slope], inputs, ["f", "grad_f_x"]),
            "jac_g": ca.Function("nlp_jac_g", [x, parameters], [conditions, jacobian], inputs, ["g", "jac_g_x"]),
            "hess_lag": ca.Function(
                "nlp_hess_l",
                [x, parameters, scale, multipliers],
                [hessian],
                ["x", "p", "lam_f", "lam_g"],
                ["triu_hess_gamma_x_x"],
            ),
        }
        room = np.zeros((count, points.conditions))
        room[:, points.equalities :] = np.inf
        limit = np.full(self.size, np.inf)
        limit[self._voltages :] = self.problem.settings.voltage_limit
        low, high = np.zeros(room.size + rows.shape[0]), np.concatenate([room.ravel(), np.zeros(rows.shape[0])])
        self._bounds = {"lbx": -limit, "ubx": limit, "lbg": low, "ubg": high}

    def solve(
        self, guess: Array, smoothing: float, multipliers: Multipliers | None = None, **options: Any
    ) -> tuple[Array, Multipliers, dict[str, Any]]:
        """IPOPT from a guess (and, for a warm start, multipliers).

        Args:
            guess: variables, (size,).
            smoothing: the tracking error e counts as sqrt(e^2 + smoothing^2) [m].
            multipliers: multipliers of an earlier call.
            options: options of IPOPT, without the prefix.

        Returns:
            The variables, the multipliers and IPOPT's statistics.
        """
        ca = casadi()
        chosen = {**SOLVER, **options}
        warm = {} if multipliers is None else {"lam_x0": multipliers[0], "lam_g0": multipliers[1]}
        if warm:
            # A larger barrier would first drive the solution away from where it has already come.
            pushes = {f"warm_start_{part}_push": 1e-6 for part in ("bound", "mult_bound", "slack_bound")}
            chosen = {"warm_start_init_point": "yes", "mu_init": 1e-6, **pushes, **chosen}
        kind = tuple(sorted(chosen.items()))
        if kind not in self._solvers:
            named = {f"ipopt.{name}": value for name, value in chosen.items()}
            options = {"print_time": False, **self._derivatives, **named}
            self._solvers[kind] = ca.nlpsol("solver", "ipopt", self._program, options)
        solver = self._solvers[kind]
        found = solver(x0=guess, p=self._parameters(smoothing), **self._bounds, **warm)
        x, lam_x, lam_g = (np.array(found[name]).ravel() for name in ("x", "lam_x", "lam_g"))
        return x, (lam_x, lam_g), solver.stats()

    def _parameters(self, smoothing: float) -> Array:
        settings = self.problem.settings
        numbers = smoothing, settings.tracking_weight, settings.energy_weight, self.inverse.payload
        first = self._linear[self._voltages : self._voltages + self.n]
        return np.concatenate([numbers, self._target.ravel(), self._velocity, first])

    def residuals(self, x: Array, smoothing: float, multipliers: Multipliers) -> tuple[float, float, float]:
        """How far a point is from meeting the first-order conditions.

        Args:
            x: variables, (size,).
            smoothing: as in `solve`.
            multipliers: as `solve` returns them.

        Returns:
            The largest entry of the Lagrangian's gradient (in units of cost per unit of the variable), of the violation
            of conditions and bounds (N m, m/s, rad, rad/s, V), and of a multiplier times the distance from the bound
            that it is of [cost].
        """
        p, bounds = self._parameters(smoothing), self._bounds
        slope = np.array(self._derivatives["grad_f"](x, p)[1]).ravel()
        conditions, jacobian = self._derivatives["jac_g"](x, p)
        slope = slope + np.array(jacobian.T @ multipliers[1]).ravel() + multipliers[0]
        values = np.concatenate([x, np.array(conditions).ravel()])
        low = np.concatenate([bounds["lbx"], bounds["lbg"]])
        high = np.concatenate([bounds["ubx"], bounds["ubg"]])
        prices = np.concatenate(multipliers)
        with np.errstate(invalid="ignore"):
            slack = np.where(prices > 0.0, high - values, np.where(prices < 0.0, values - low, 0.0))
            apart = np.abs(prices * np.where(prices == 0.0, 0.0, slack))
        violation = np.maximum(low - values, values - high).max(initial=0.0)
        return float(np.abs(slope).max()), float(violation), float(np.where(low == high, 0.0, apart).max())

    def taken_over(self, other: Transcription, x: Array, multipliers: Multipliers) -> tuple[Array, Multipliers]:
        """Variables and multipliers of another mesh's solution of the same problem on this one's points.

        Both are polynomials over the period. A condition's multiplier is its costate times the point's weight in the
        quadrature, and only the costate is smooth.
        """
        parts, voltage = other.split(x)
        with_start = np.concatenate([[0.0], other.fractions])
        through, inner = lagrange(with_start, self.fractions), lagrange(other.fractions, self.fractions)
        values = []
        for name, value in parts.items():
            if name in self._start:
                before = np.concatenate([self._start[name][None], value[:-1, -1]])
                values.append(through @ np.concatenate([before[:, None], value], axis=1))
            else:
                values.append(inner @ value)
        points = np.concatenate(values, axis=-1).ravel()
        own, rows = self.points.conditions, self.periods * other.degree * self.points.conditions
        scale = self._weights[:, None] * inner / other._weights
        theirs = multipliers[1][:rows].reshape(-1, other.degree, own), multipliers[1][rows:]
        conditions = [(scale @ one.reshape(self.periods, other.degree, -1)).ravel() for one in theirs]
        bounds = np.concatenate([np.zeros(self._voltages), multipliers[0][other._voltages :]])
        return np.concatenate([points, voltage.ravel()]), (bounds, np.concatenate(conditions))

    def later(self, x: Array, multipliers: Multipliers | None) -> tuple[Array, Multipliers | None]:
        """Variables and multipliers one control period later; those of the last period stay in it, too."""
        conditions = self.periods * self.degree * self.points.conditions

        def moved(values: Array, end: int) -> Array:
            kinds = (part.reshape(self.periods, -1) for part in (values[:end], values[end:]))
            return np.concatenate([np.concatenate([rows[1:], rows[-1:]]).ravel() for rows in kinds])

        if multipliers is None:
            return moved(x, self._voltages), None
        return moved(x, self._voltages), (moved(multipliers[0], self._voltages), moved(multipliers[1], conditions))

    def split(self, x: Array) -> tuple[dict[str, Array], Array]:
        """The quantities of `NAMES` at all points, each (periods, degree, ...), and the voltages [V], (periods, n)."""
        points = x[: self._voltages].reshape(self.periods, self.degree, -1)
        parts = np.split(points, self.n * np.arange(1, len(NAMES)), axis=-1)
        return dict(zip(NAMES, parts, strict=True)), x[self._voltages :].reshape(self.periods, self.n)

    def join(self, q: Array, q_dot: Array, q_ddot: Array, voltage: Array) -> Array:
        """Variables from a motion at all points, each (periods, degree, n), and voltages [V], (periods, n)."""
        drive = self.inverse.drive(q, q_dot, q_ddot)
        points = np.concatenate([q, q_dot, q_ddot, drive.current, drive.elbow_force], axis=-1)
        return np.concatenate([points.ravel(), voltage.ravel()])

    def cost(self, x: Array) -> float:
        """Negative return of a solution without the tail, the tracking error taken as it is."""
        settings, q = self.problem.settings, self.split(x)[0]["q"][:, -1]
        error = np.linalg.norm(hand_position(settings.parsed_arm, q) - self._target, axis=-1)
        return float(settings.tracking_weight * error.sum() + settings.energy_weight * self.energy(x) / self.period)

    def energy(self, x: Array) -> float:
        """Electrical energy of a solution [J], signed."""
        return float(x @ (self._power_form @ x) / 2 + self._linear @ x) * self.period

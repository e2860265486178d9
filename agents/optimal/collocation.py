"""Episode of the environment as a sparse nonlinear program: Radau collocation of arm, motors and elbows.

One control period under held voltages is one element with `degree` Radau points, which are stiffly accurate: the
armature (1.5 ms) and the light links (5 ms) are faster than the period (20 ms). The motion equations are
inverse-dynamics residuals, so that no linear solve enters an expression; the elbows' velocities are held at zero (held
heights, of index 3, have multipliers that swing between the points). Every point's derivatives are one small CasADi
function mapped over all points, the rest is constant.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.inverse_dynamics import InverseDynamics
from agents.optimal.points import NAMES, Points
from agents.optimal.problem import Problem
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
}
"""Options of IPOPT for every solve."""


class Transcription:
    """Program and its solver. Variables: all points one after the other, then the voltages of all periods.

    Args:
        problem: problem to solve.
        degree: Radau points in a control period.
    """

    def __init__(self, problem: Problem, degree: int) -> None:
        import casadi as ca

        # CasADi from 3.8 on warns of NumPy's functions on its symbols unless told which behaviour is meant.
        if hasattr(ca.GlobalOptions, "setNumpyMode"):
            ca.GlobalOptions.setNumpyMode(-1)
        settings = problem.settings
        self.problem, self.degree = problem, degree
        self.periods, self.period = settings.horizon, settings.control_period
        self.inverse = InverseDynamics(settings.parsed_arm, settings.elbow_joints, settings.payload)
        self.n = settings.parsed_arm.n_joints
        self.points = Points(self.inverse, problem.above_table)
        self.fractions = np.array(ca.collocation_points(degree, "radau"))
        self._derivative = np.array(ca.collocation_coeff(self.fractions.tolist())[0])
        self._weights = np.linalg.inv(self._derivative[1:].T)[-1]
        self._voltages = self.periods * degree * self.points.size
        self.size = self._voltages + self.periods * self.n
        self._start = {"q": problem.start, "q_dot": np.zeros(self.n), "current": np.zeros(self.n)}
        self._write(ca)

    def _place(self, period: int, point: int, name: str) -> Any:
        """Indices of a quantity at point 1..degree of a period; point 0 is the last one before (None at the start)."""
        at = period * self.degree + point - 1
        return None if at < 0 else at * self.points.size + NAMES.index(name) * self.n + np.arange(self.n)

    def _collocation(self) -> tuple[Any, Array]:
        """Constant rows A x = b: derivatives of q, q_dot and current at every point."""
        from scipy import sparse

        inverse, h, rows, right = self.inverse, self.period, _Triplets(), []
        row = np.arange(self.n)
        for k in range(self.periods):
            for j in range(1, self.degree + 1):
                for name, rate in (("q", "q_dot"), ("q_dot", "q_ddot"), ("current", None)):
                    scale = inverse.inductance / h if rate is None else np.ones(self.n)
                    b = np.zeros(self.n)
                    for m in range(self.degree + 1):
                        slope, place = scale * self._derivative[m, j - 1], self._place(k, m, name)
                        if place is None:
                            b -= slope * self._start[name]
                        else:
                            rows.add(row, place, slope)
                    if rate is not None:
                        rows.add(row, self._place(k, j, rate), np.full(self.n, -h))
                    else:
                        rows.add(row, self._place(k, j, "current"), inverse.resistance)
                        rows.add(row, self._place(k, j, "q_dot"), inverse.torque_constant)
                        rows.add(row, self._voltages + k * self.n + np.arange(self.n), -np.ones(self.n))
                    right.append(b)
                    row = row + self.n
        return sparse.csc_matrix(rows.triplets, shape=(len(right) * self.n, self.size)), np.concatenate(right)

    def _power(self) -> tuple[Any, Array]:
        """Sum of the periods' mean powers as x^T P x / 2 + p x, P's upper triangle.

        Under a held voltage the charge is exactly (v h - K_m dq - L di) / R, so the energy is v times that.
        """
        from scipy import sparse

        inverse, h, entries, linear = self.inverse, self.period, _Triplets(), np.zeros(self.size)
        for k in range(self.periods):
            v = self._voltages + k * self.n + np.arange(self.n)
            entries.add(v, v, 2.0 / inverse.resistance)
            for name, constant in (("q", inverse.torque_constant), ("current", inverse.inductance)):
                slope = constant / inverse.resistance / h
                entries.add(self._place(k, self.degree, name), v, -slope)
                before = self._place(k, 0, name)
                if before is None:
                    linear[v] += slope * self._start[name]
                else:
                    entries.add(before, v, slope)
        return sparse.csc_matrix(entries.triplets, shape=(self.size, self.size)), linear

    def _write(self, ca: Any) -> None:
        from scipy import sparse

        points, count, volts = self.points, self.periods * self.degree, self.periods * self.n
        rows, right = self._collocation()
        power, linear = self._power()
        whole = power + sparse.triu(power, 1).T
        self._power_form = (whole, linear)
        A, P, upper, p = (_matrix(ca, rows), _matrix(ca, whole), _matrix(ca, power), ca.DM(linear))
        x = ca.MX.sym("x", self.size)
        parameters = ca.MX.sym("p", 3)
        scale, multipliers = ca.MX.sym("f"), ca.MX.sym("g", count * points.conditions + rows.shape[0])
        smoothing, tracking, energy = parameters[0], parameters[1], parameters[2]
        Z = ca.reshape(x[: self._voltages], points.size, count)
        # The reward depends on the last point of each period alone.
        last = np.tile(np.arange(self.degree) == self.degree - 1, self.periods).astype(float)
        target = ca.DM(np.repeat(self.problem.target, self.degree, axis=0).T)
        seen = (Z, target, ca.repmat(smoothing, 1, count), ca.DM(last[None]) * tracking)
        cost = ca.sum2(points.cost.map(count)(*seen)) + energy * (ca.dot(x, ca.mtimes(P, x)) / 2 + ca.dot(p, x))
        slope = ca.vertcat(ca.vec(points.slope.map(count)(*seen)), ca.MX.zeros(volts)) + energy * (ca.mtimes(P, x) + p)
        conditions = ca.vertcat(ca.vec(points.residual.map(count)(Z)), ca.mtimes(A, x))
        blocks = ca.horzcat(
            ca.diagcat(*[points.jacobian_sparsity] * count), ca.Sparsity(count * points.conditions, volts)
        )
        jacobian = ca.vertcat(ca.MX(blocks, ca.vec(points.jacobian.map(count)(Z))), ca.MX(A))
        own = ca.reshape(multipliers[: count * points.conditions], points.conditions, count)
        curvature = ca.vec(points.hessian.map(count)(*seen, ca.repmat(scale, 1, count), own))
        places = ca.diagcat(*[points.hessian_sparsity] * count, ca.Sparsity(volts, volts))
        hessian = ca.MX(places, curvature) + scale * energy * upper
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
        low = np.concatenate([np.zeros(count * points.conditions), right])
        room = np.zeros((count, points.conditions))
        room[:, points.equalities :] = np.inf
        limit = np.full(self.size, np.inf)
        limit[self._voltages :] = self.problem.settings.voltage_limit
        self._bounds = {"lbx": -limit, "ubx": limit, "lbg": low, "ubg": np.concatenate([room.ravel(), right])}

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
        import casadi as ca

        chosen = {**SOLVER, **options}
        warm = {} if multipliers is None else {"lam_x0": multipliers[0], "lam_g0": multipliers[1]}
        if warm:
            # A larger barrier would first drive the solution away from where it has already come.
            pushes = {f"warm_start_{part}_push": 1e-6 for part in ("bound", "mult_bound", "slack_bound")}
            chosen = {"warm_start_init_point": "yes", "mu_init": 1e-6, **pushes, **chosen}
        solver = ca.nlpsol(
            "solver",
            "ipopt",
            self._program,
            {"print_time": False, **self._derivatives, **{f"ipopt.{k}": v for k, v in chosen.items()}},
        )
        found = solver(x0=guess, p=self._parameters(smoothing), **self._bounds, **warm)
        x, lam_x, lam_g = (np.array(found[name]).ravel() for name in ("x", "lam_x", "lam_g"))
        return x, (lam_x, lam_g), solver.stats()

    def _parameters(self, smoothing: float) -> list[float]:
        return [smoothing, self.problem.settings.tracking_weight, self.problem.settings.energy_weight]

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
        through, inner = _lagrange(with_start, self.fractions), _lagrange(other.fractions, self.fractions)
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
        """Negative return of a solution, the tracking error taken as it is."""
        settings, q = self.problem.settings, self.split(x)[0]["q"][:, -1]
        error = np.linalg.norm(hand_position(settings.parsed_arm, q) - self.problem.target, axis=-1)
        return float(settings.tracking_weight * error.sum() + settings.energy_weight * self.energy(x) / self.period)

    def energy(self, x: Array) -> float:
        """Electrical energy of a solution [J], signed."""
        form, linear = self._power_form
        return float(x @ (form @ x) / 2 + linear @ x) * self.period


def _lagrange(nodes: Array, at: Array) -> Array:
    """Matrix (len(at), len(nodes)) from a polynomial's values at nodes to those at other places."""
    return np.linalg.solve(np.vander(nodes).T, np.vander(at, nodes.size).T).T


class _Triplets:
    """Entries of a sparse matrix, gathered block by block."""

    def __init__(self) -> None:
        self._rows: list[Array] = []
        self._columns: list[Array] = []
        self._values: list[Array] = []

    def add(self, rows: Any, columns: Any, values: Array) -> None:
        self._rows.append(rows)
        self._columns.append(columns)
        self._values.append(values)

    @property
    def triplets(self) -> tuple[Array, tuple[Array, Array]]:
        return np.concatenate(self._values), (np.concatenate(self._rows), np.concatenate(self._columns))


def _matrix(ca: Any, matrix: Any) -> Any:
    matrix = matrix.tocsc()
    matrix.sum_duplicates()
    matrix.sort_indices()
    places = ca.Sparsity(*matrix.shape, matrix.indptr.tolist(), matrix.indices.tolist())
    return ca.DM(places, matrix.data)

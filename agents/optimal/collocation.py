"""Episode of the environment as a sparse nonlinear program: Radau collocation of arm, motors and elbows.

One control period under held voltages is one element with `degree` Radau points, which are stiffly accurate: the
armature (1.5 ms) and the light links (5 ms) are faster than the period (20 ms). The motion equations are
inverse-dynamics residuals, so that no linear solve enters an expression; the elbows' velocities are held at zero (held
heights, of index 3, have multipliers that swing between the points). Every point's derivatives are one small CasADi
function mapped over all points, the rest is constant.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.inverse_dynamics import InverseDynamics
from elbow_gym.kinematics import hand_position, inverse_kinematics
from elbow_gym.task.settings import Settings

Array = NDArray[np.float64]

SETTLING_TIME = 0.05
"""Time constant with which an elbow's height left by the discretisation decays [s]."""
NAMES = ("q", "q_dot", "q_ddot", "current", "elbow_force")


@dataclass(frozen=True)
class Problem:
    """Problem of least negative return of one episode of an environment from its start without noise."""

    settings: Settings
    above_table: bool = False
    """Whether joints 3..n and the hand must have z >= 0."""

    @cached_property
    def start(self) -> Array:
        """Start pose [rad], (n,). The nominal pose must lie on the elbows' plane."""
        arm, circle = self.settings.parsed_arm, self.settings.parsed_circle
        pose = np.array(arm.nominal_pose)
        if self.settings.start == "paper":
            return pose
        return inverse_kinematics(arm, pose, circle.position(circle.angle(0.0, float(circle.phase))))[0]

    @cached_property
    def target(self) -> Array:
        """Targets at the ends of the control periods [m], (N, 3)."""
        circle, settings = self.settings.parsed_circle, self.settings
        time = settings.control_period * np.arange(1, settings.horizon + 1)
        return circle.position(circle.angle(time, float(circle.phase)))


class Points:
    """CasADi functions of one collocation point: residuals, cost and their derivatives."""

    def __init__(self, inverse: InverseDynamics, above_table: bool) -> None:
        import casadi as ca

        arm, n, p = inverse.arm, inverse.arm.n_joints, len(inverse.elbows)
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
        rho = ca.dot(ca.DM(length), ca.sin(phi).T)
        error = ca.vertcat(rho * ca.cos(q[0]), rho * ca.sin(q[0]), heights[n - 1]) - target
        cost = weight * ca.sqrt(ca.dot(error, error) + smoothing**2)
        scale, multipliers = ca.SX.sym("scale"), ca.SX.sym("multipliers", self.conditions)
        jacobian = ca.jacobian(conditions, z)
        hessian = ca.triu(ca.hessian(scale * cost + ca.dot(multipliers, conditions), z)[0])
        seen = [z, target, smoothing, weight]
        self.size = z.numel()
        self.residual = ca.Function("residual", [z], [conditions])
        self.cost = ca.Function("cost", seen, [cost])
        self.slope = ca.Function("slope", seen, [ca.gradient(cost, z)])
        self.jacobian = ca.Function("jacobian", [z], [ca.vertcat(*jacobian.nonzeros())])
        self.hessian = ca.Function("hessian", [*seen, scale, multipliers], [ca.vertcat(*hessian.nonzeros())])
        self.jacobian_sparsity, self.hessian_sparsity = jacobian.sparsity(), hessian.sparsity()


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
        self.inverse = InverseDynamics(settings.parsed_arm, settings.elbow_joints)
        self.n = settings.parsed_arm.n_joints
        self.points = Points(self.inverse, problem.above_table)
        self.fractions = np.array(ca.collocation_points(degree, "radau"))
        self._derivative = np.array(ca.collocation_coeff(self.fractions.tolist())[0])
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
        self, guess: Array, smoothing: float, multipliers: Any = None, **options: Any
    ) -> tuple[Array, Any, dict[str, Any]]:
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

        settings = self.problem.settings
        chosen = {"print_level": 0, "sb": "yes", "linear_solver": "mumps", **options}
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
        parameters = [smoothing, settings.tracking_weight, settings.energy_weight]
        found = solver(x0=guess, p=parameters, **self._bounds, **warm)
        return np.array(found["x"]).ravel(), (found["lam_x"], found["lam_g"]), solver.stats()

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

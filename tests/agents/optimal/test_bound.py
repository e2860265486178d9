"""Optimal control on a short episode: derivatives, constraints, and the simulator reaching what was promised."""

import numpy as np
import pytest

from agents.control.lqr import TimeVaryingLQR
from agents.control.trajectory import OpenLoop, Trajectory
from agents.optimal.bound import rollout
from elbow_gym.kinematics import elbow_heights, inverse_kinematics
from elbow_gym.task.circle import Circle
from elbow_gym.task.settings import Settings


@pytest.fixture(scope="module")
def short():
    """0.1 s from the target with two elbows, and its solution."""
    pytest.importorskip("casadi")
    from agents.optimal.bound import solve
    from agents.optimal.collocation import Problem, Transcription

    settings = Settings(start="on_target", duration=0.1, start_noise=0.0)
    program = Transcription(Problem(settings), 2)
    arm, circle = settings.parsed_arm, Circle()
    angle = circle.angle(0.02 * np.arange(6), 0.0)
    q, _ = inverse_kinematics(arm, arm.nominal_pose, circle.position(angle), circle.velocity(angle))
    guess = Trajectory(q, np.gradient(q, 0.02, axis=0), np.zeros_like(q), np.zeros_like(q[1:]))
    return program, solve(program, guess, (0.03, 0.003))


def test_derivatives_of_the_program_are_those_of_its_functions(short):
    import casadi as ca

    program, _ = short
    x, p = program._program["x"], [0.03, 1.0, 0.001]
    rng = np.random.default_rng(0)
    at, along = 0.3 * rng.normal(size=program.size), rng.normal(size=program.size)
    value = ca.Function("value", [x, program._program["p"]], [program._program["f"], program._program["g"]])
    step = 1e-6
    (f1, g1), (f0, g0) = value(at + step * along, p), value(at - step * along, p)
    _, slope = program._derivatives["grad_f"](at, p)
    _, jacobian = program._derivatives["jac_g"](at, p)
    assert float(ca.dot(slope, along)) == pytest.approx(float(f1 - f0) / (2 * step), rel=1e-6)
    np.testing.assert_allclose(np.array(jacobian @ along), np.array(g1 - g0) / (2 * step), rtol=1e-5, atol=1e-4)
    multipliers = rng.normal(size=g1.numel())
    hessian = program._derivatives["hess_lag"](at, p, 0.7, multipliers)
    hessian = np.array(ca.triu2symm(hessian) @ along).ravel()

    def lagrangian(point):
        return np.array(
            0.7 * program._derivatives["grad_f"](point, p)[1]
            + program._derivatives["jac_g"](point, p)[1].T @ multipliers
        ).ravel()

    expected = (lagrangian(at + step * along) - lagrangian(at - step * along)) / (2 * step)
    np.testing.assert_allclose(hessian, expected, rtol=1e-5, atol=1e-4)


def test_solution_keeps_the_elbows_down_and_the_voltages_within_the_supply(short):
    _, solution = short
    assert np.abs(elbow_heights(Settings().parsed_arm, solution.trajectory.q, (4, 7))).max() < 1e-4
    assert np.abs(solution.trajectory.voltage).max() <= 24.0 + 1e-6


def test_simulator_reaches_the_predicted_cost_open_loop_and_under_the_lqr(short):
    program, solution = short
    for controller in (OpenLoop, TimeVaryingLQR):
        found, _ = rollout(program.problem.settings, lambda env, kind=controller: kind(env, solution.trajectory))
        assert -found == pytest.approx(solution.cost, rel=0.02)


def test_a_warm_start_stays_where_the_last_solve_has_come(short):
    from agents.optimal.bound import variables

    program, solution = short
    x, multipliers, _ = program.solve(variables(program, solution.trajectory), 0.003)
    again, _, stats = program.solve(x, 0.003, multipliers)
    assert stats["iter_count"] <= 3
    assert program.cost(again) == pytest.approx(program.cost(x), rel=1e-6)


def test_an_impossible_problem_is_said_to_have_failed(short):
    from agents.optimal.bound import SolveError, solve

    program, solution = short
    with pytest.raises(SolveError, match=r"IPOPT must converge at a smoothing of 0\.03 m, got Maximum_Iterations"):
        solve(
            program, Trajectory(**{**vars(solution.trajectory), "voltage": solution.trajectory.voltage * 0}), max_iter=1
        )

"""Optimal control on a short episode: derivatives, constraints, and the simulator reaching what was promised."""

from dataclasses import replace

import numpy as np
import pytest

from agents.control.lqr import TimeVaryingLQR
from agents.control.trajectory import OpenLoop, Trajectory
from agents.optimal.guesses import rollout
from elbow_gym.kinematics import elbow_heights, inverse_kinematics
from elbow_gym.task.circle import Circle
from elbow_gym.task.settings import Settings


@pytest.fixture(scope="module")
def short():
    """0.1 s from the target with two elbows, and its solution."""
    pytest.importorskip("casadi")
    from agents.optimal.problem import Problem
    from agents.optimal.solution import solve
    from agents.planning.collocation import Transcription

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
    x, p = program._program["x"], program._parameters(0.03)
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
        assert found == pytest.approx(solution.cost, rel=0.02)


def test_a_warm_start_stays_where_the_last_solve_has_come(short):
    from agents.optimal.solution import variables

    program, solution = short
    x, multipliers, _ = program.solve(variables(program, solution.trajectory), 0.003)
    again, _, stats = program.solve(x, 0.003, multipliers)
    assert stats["iter_count"] <= 3
    assert program.cost(again) == pytest.approx(program.cost(x), rel=1e-6)


def test_an_impossible_problem_is_said_to_have_failed(short):
    from agents.optimal.solution import SolveError, solve

    program, solution = short
    with pytest.raises(SolveError, match=r"IPOPT must converge at a smoothing of 0\.01 m, got Maximum_Iterations"):
        solve(
            program, Trajectory(**{**vars(solution.trajectory), "voltage": solution.trajectory.voltage * 0}), max_iter=1
        )


def test_a_finer_mesh_takes_over_the_costates(short):
    from agents.optimal.solution import Point, solve
    from agents.planning.collocation import Transcription

    program, solution = short
    fine = Transcription(program.problem, 3)
    x, multipliers = fine.taken_over(program, solution.point.x, solution.point.multipliers)
    assert fine.cost(x) == pytest.approx(solution.cost, rel=1e-9)
    again = Transcription(program.problem, 2).taken_over(fine, x, multipliers)
    np.testing.assert_allclose(again[0], solution.point.x, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(again[1][1], solution.point.multipliers[1], rtol=1e-7, atol=1e-9)
    # Costates of another mesh are nearly those of this one: far fewer remain to be found than without them.
    none = [np.zeros_like(part) for part in multipliers]
    assert fine.residuals(x, 0.003, multipliers)[0] < 0.05 * fine.residuals(x, 0.003, none)[0]
    refined = solve(fine, Point(x, multipliers), (0.003,))
    assert fine.residuals(refined.point.x, 0.003, refined.point.multipliers)[0] < 1e-6
    assert refined.cost == pytest.approx(solution.cost, rel=5e-3)


def test_residuals_see_what_is_no_solution(short):
    program, solution = short
    x, multipliers = solution.point.x, solution.point.multipliers
    assert max(program.residuals(x, solution.smoothing, multipliers)) < 1e-5
    moved = x.copy()
    moved[program.size - 1] += 30.0
    assert program.residuals(moved, solution.smoothing, multipliers)[1] > 1.0
    priced = program.residuals(x, solution.smoothing, (multipliers[0] + 0.5, multipliers[1]))
    assert priced[0] > 0.1
    # Half a unit of cost a volt, of a voltage that is volts away from its limit.
    assert priced[2] > 1.0


def test_payload_enters_the_program_and_the_simulator_agrees(short):
    """A heavy load bends the solution; the simulator with the load reaches what the program promises."""
    from agents.optimal.problem import Problem
    from agents.optimal.solution import Point, solve
    from agents.planning.collocation import Transcription

    program, solution = short
    settings = replace(program.problem.settings, payload=0.3)
    loaded = solve(Transcription(Problem(settings), 2), Point(solution.point.x), (0.03, 0.003))
    assert abs(loaded.cost / solution.cost - 1.0) > 0.05
    found, _ = rollout(settings, lambda env: OpenLoop(env, loaded.trajectory))
    assert found == pytest.approx(loaded.cost, rel=0.02)

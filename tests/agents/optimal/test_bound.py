"""Optimal control on a short episode: derivatives, constraints, and the simulator reaching what was promised."""

import json

import numpy as np
import pytest

from agents.control.lqr import TimeVaryingLQR, linearised_periods, lqr_gains
from agents.control.trajectory import OpenLoop, Trajectory
from agents.optimal.bound import rollout
from benchmarks.optimal import Cell, cached, cells, files
from elbow_gym import Simulator
from elbow_gym.kinematics import elbow_heights, inverse_kinematics
from elbow_gym.task.circle import Circle
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv


def resting(arm, periods=5):
    """The start pose at rest, without voltages."""
    q, zero = np.tile(arm.nominal_pose, (periods + 1, 1)), np.zeros((periods + 1, arm.n_joints))
    return Trajectory(q, zero, zero, zero[1:])


def test_trajectory_survives_its_file(arm, tmp_path):
    trajectory = resting(arm)
    trajectory.save(tmp_path / "t.npz")
    for name, array in vars(Trajectory.load(tmp_path / "t.npz")).items():
        np.testing.assert_array_equal(array, getattr(trajectory, name))


def test_open_loop_plays_the_voltages_period_by_period(arm):
    trajectory = resting(arm)
    trajectory.voltage[:] = np.arange(50.0).reshape(5, 10) / 10.0
    _, recording = rollout(Settings(duration=0.1), lambda env: OpenLoop(env, trajectory))
    np.testing.assert_allclose(recording.voltage[1:, 0], trajectory.voltage, rtol=1e-6)


@pytest.mark.parametrize("elbows", [0, 2])
def test_linearised_period_predicts_the_simulators_next_state(arm, elbows):
    settings, trajectory = Settings(elbows=elbows, duration=0.1), resting(arm)
    A, B = linearised_periods(settings, trajectory)
    simulator = Simulator(arm, elbows, 2)
    rng = np.random.default_rng(0)
    current, voltage = 1e-3 * rng.normal(size=10), 1e-3 * rng.normal(size=10)
    poses = simulator.on_table(np.array([arm.nominal_pose, arm.nominal_pose + 1e-4 * rng.normal(size=10)]))
    simulator.reset(poses, current=np.stack([np.zeros(10), current]))
    simulator.step(np.stack([np.zeros(10), voltage]), settings.n_substeps)
    after = np.concatenate([simulator.q, simulator.q_dot, simulator.current], axis=-1)
    deviation = np.concatenate([poses[1] - poses[0], np.zeros(10), current])
    np.testing.assert_allclose(A[0] @ deviation + B[0] @ voltage, after[1] - after[0], atol=2e-5)


def test_lqr_without_a_deviation_gives_the_planned_voltage(arm):
    trajectory = resting(arm)
    trajectory.voltage[:] = 3.0
    env = ElbowArmVectorEnv(1, duration=0.1, start_noise=0.0)
    observation, _ = env.reset(seed=0)
    action, _ = TimeVaryingLQR(env, trajectory).predict(observation)
    np.testing.assert_allclose(action, 3.0 / 24.0, atol=1e-6)


def test_lqr_gains_after_the_last_period_only_weigh_the_last_cost(arm):
    settings = Settings(duration=0.1)
    assert lqr_gains(settings, resting(arm)).shape == (5, 10, 30)
    with pytest.raises(ValueError, match="trajectory must have 250 control periods, got 5"):
        TimeVaryingLQR(ElbowArmVectorEnv(1), resting(arm))


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


def test_a_result_of_another_problem_is_not_taken_over(arm, tmp_path):
    cell = Cell(2)
    card, trajectory = files(cell, tmp_path)
    resting(arm).save(trajectory)
    for question, expected in ((cell.question, {"cost": 1.0}), ({**cell.question, "duration": 4.0}, None)):
        card.write_text(json.dumps({"problem": question, "figures": {"cost": 1.0}}))
        assert cached(cell, tmp_path) == expected


def test_cells_have_names_of_their_own():
    names = [cell.name for cell in cells()]
    assert len(set(names)) == len(names)

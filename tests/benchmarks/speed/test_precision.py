"""Work and precision: the reference, the errors and orders of the integrators, and times at an error by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.speed import precision
from benchmarks.speed.own import OURS
from benchmarks.speed.peers import MUJOCO
from benchmarks.speed.precision import GROWING, METHODS, Method, Point, Trial, errors, outcome, run_of, truth
from benchmarks.speed.rows import Row
from elbow_gym.dynamics import forward_dynamics


@pytest.fixture(scope="module")
def true():
    return truth()


def error_of(true, family, integrator, substeps, arms=1):
    return errors(outcome(Trial(family, integrator, arms, substeps)), true)


@pytest.mark.soak
def test_both_integrators_agree_on_the_reference(true):
    assert max(errors(truth("rk4"), true)) < 1e-10


@pytest.mark.slow
def test_the_first_period_of_the_reference_is_that_of_the_printed_equations():
    run = run_of(Trial(OURS, "exponential", 1, precision.TRUE_STEPS))
    next(run.periods())
    arm = precision.paper_arm()

    def rates(_, state):
        found = forward_dynamics(arm, *state.reshape(3, -1), precision.VOLTAGES[0])
        return np.concatenate([state[10:20], found.q_ddot, found.current_dot])

    first = np.concatenate([arm.nominal_pose, np.zeros(20)])
    exact = solve_ivp(rates, (0.0, precision.PERIOD), first, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    # Errors of 1e-12 in the currents' transient pass into the rates.
    np.testing.assert_allclose(run.state().ravel(), exact, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(
    ("integrator", "arms"),
    [("exponential", 1), pytest.param("rk4", 1, marks=pytest.mark.soak), (GROWING, 1), (GROWING, 3)],
)
def test_halving_the_steps_of_this_project_divides_the_error_by_sixteen(true, integrator, arms):
    coarse, fine = (error_of(true, OURS, integrator, count, arms)[0] for count in (80, 160))
    assert 3.7 < np.log2(coarse / fine) < 5.0


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_halving_mujocos_steps_halves_its_error_of_the_same_second(true, integrator):
    pytest.importorskip("mujoco")
    coarse, fine = (outcome(Trial(MUJOCO, integrator, 1, count)) for count in (400, 800))
    for before, after in zip(errors(coarse, true), errors(fine, true), strict=True):
        assert 1.8 < before / after < 2.2
    # Extrapolated, they meet the reference: arm, voltages and energy are the same.
    extrapolated = 2.0 * fine[0] - coarse[0], 2.0 * fine[1] - coarse[1]
    assert max(errors(extrapolated, true)) < 2e-5


def test_growing_steps_are_the_environments_own_cut_into_equal_parts():
    default = precision.DEFAULT.substeps
    assert np.array_equal(Trial(OURS, GROWING, 1, len(default)).steps, default)
    halves = Trial(OURS, GROWING, 1, 2 * len(default)).steps
    np.testing.assert_allclose(halves[::2] + halves[1::2], default, rtol=1e-15)
    for (_, integrator, _), counts in METHODS.items():
        assert integrator != GROWING or all(count % len(default) == 0 for count in counts)


def test_error_is_relative_to_the_largest_of_its_kind():
    true = np.array([[1.0, -4.0], [10.0, 0.0], [0.5, 0.1]]), 20.0
    found = true[0] + [[0.0, 0.04], [0.0, -0.5], [0.001, 0.0]], 19.0
    assert errors(found, true) == pytest.approx((0.05, 0.05))


def method(*figures):
    """A method of points with numbers of steps, errors and times."""
    return Method(
        MUJOCO,
        "Euler",
        1,
        tuple(
            Point(trial := Trial(MUJOCO, "Euler", 1, steps), Row(trial.contender(), (2.0 * time, time)), error, error)
            for steps, error, time in figures
        ),
    )


def state(point):
    return point.state_error


def test_time_at_an_error_lies_between_two_points_in_logarithms():
    found = method((10, 1e-2, 1.0), (100, 1e-4, 10.0), (1000, 1e-6, 100.0))
    assert found.order == pytest.approx(2.0)
    assert found.time_at(1e-3, state) == pytest.approx(np.sqrt(10.0))
    assert found.time_at(1e-4, state) == pytest.approx(10.0)
    assert found.time_at(0.5, state) == 1.0
    assert found.time_at(1e-7, state) is None


def test_an_error_that_is_small_by_chance_and_grows_again_does_not_count():
    found = method((10, 1e-2, 1.0), (20, 1e-6, 2.0), (40, 1e-2, 4.0), (80, 1e-4, 8.0))
    assert found.time_at(1e-3, state) == pytest.approx(np.sqrt(32.0))


def test_best_peer_is_the_fastest_of_mujocos_that_reach_the_error():
    slow, fast = method((10, 1e-6, 3.0), (20, 1e-7, 6.0)), method((10, 1e-2, 1.0), (20, 1e-5, 2.0))
    assert precision.best([slow, fast], 1e-5, state) == 2.0
    assert precision.best([slow, fast], 1e-6, state) == 3.0
    assert precision.best([replace(slow, family=OURS), fast], 1e-6, state) is None

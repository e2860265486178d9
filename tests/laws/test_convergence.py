"""Runs converge with the timestep: at order 4, to each other, and to the paper's equations integrated elsewhere."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from elbow_gym import Simulator, dynamics
from elbow_gym.simulation.step_limit import INTEGRATORS
from tests.support.arms import ELBOWS, shortened, started, uneven_arm


def end(elbows, timestep, integrator):
    """Angles, rates and currents of the paper's arm after a tenth of a second under random voltages."""
    sim = Simulator("paper", elbows, timestep=timestep, integrator=integrator)
    voltage = started(sim, 1).uniform(-24.0, 24.0, 10)
    sim.step(voltage, round(0.1 / timestep))
    return np.concatenate([sim.q[0], sim.q_dot[0], sim.current[0]])


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("elbows", [*ELBOWS, (3, 5, 8)], ids=str)
def test_halving_the_timestep_divides_the_error_by_sixteen(elbows, integrator):
    ends = [end(elbows, timestep, integrator) for timestep in (2.5e-4, 6.25e-5, 1.5625e-5)]
    coarse, fine = (np.linalg.norm(found - ends[-1]) for found in ends[:-1])
    # Two halvings; the finest run stands in for the exact one.
    assert 3.5 < np.log2(coarse / fine) / 2.0 < 4.6


@pytest.mark.parametrize("elbows", ELBOWS, ids=str)
def test_both_integrators_converge_to_the_same_run(elbows):
    # Both are off by less than 2e-10 at this step; a method of order 3 would be off by 5e-9.
    exponential, classical = (end(elbows, 6.25e-5, integrator) for integrator in INTEGRATORS)
    np.testing.assert_allclose(exponential, classical, rtol=0.0, atol=5e-10)


# The longest step is one that only the exact decay of the currents allows.
EXACT_DECAY = [(0.02 / 12, 2e-5, 1e-3)]
BOTH = [(1e-3, 2e-7, 5e-5), (1e-4, 1e-11, 1e-8)]


@pytest.mark.slow
@pytest.mark.parametrize(("integrator", "errors"), [("exponential", EXACT_DECAY + BOTH), ("rk4", BOTH)])
@pytest.mark.parametrize(("n_joints", "elbows"), [(4, ()), (5, (3, 5))])
def test_runs_converge_to_the_papers_equations_integrated_elsewhere(n_joints, elbows, integrator, errors):
    arm = shortened(uneven_arm(), n_joints)
    start = Simulator(arm, elbows, timestep=1e-3).on_table(arm.nominal_pose)[0]
    voltage = np.random.default_rng(3).uniform(-12.0, 12.0, n_joints)

    def rates(_, state):
        q, q_dot, current = state.reshape(3, n_joints)
        found = dynamics.forward_dynamics(arm, q, q_dot, current, voltage, elbows)
        return np.concatenate([q_dot, found.q_ddot, found.current_dot])

    first = np.concatenate([start, np.zeros(2 * n_joints)])
    exact = solve_ivp(rates, (0.0, 0.02), first, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    for timestep, pose_error, rate_error in errors:
        sim = Simulator(arm, elbows, timestep=timestep, integrator=integrator)
        sim.reset(start)
        sim.step(voltage, round(0.02 / timestep))
        np.testing.assert_allclose(sim.q[0], exact[:n_joints], rtol=0.0, atol=pose_error)
        rates_found = np.concatenate([sim.q_dot[0], sim.current[0]])
        np.testing.assert_allclose(rates_found, exact[n_joints:], rtol=0.0, atol=rate_error)

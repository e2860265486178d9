"""Runs converge with the timestep: at RK4's order, and to the paper's equations integrated by another method."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from elbow_gym import Simulator, dynamics
from tests.support.arms import ELBOWS, shortened, started, uneven_arm


@pytest.mark.parametrize("elbows", [*ELBOWS, (3, 5, 8)], ids=str)
def test_halving_the_timestep_divides_the_error_by_sixteen(elbows):
    ends = []
    for timestep in (2.5e-4, 6.25e-5, 1.5625e-5):
        sim = Simulator("paper", elbows, timestep=timestep)
        voltage = started(sim, 1).uniform(-24.0, 24.0, 10)
        sim.step(voltage, round(0.1 / timestep))
        ends.append(np.concatenate([sim.q[0], sim.q_dot[0], sim.current[0]]))
    coarse, fine = (np.linalg.norm(end - ends[-1]) for end in ends[:-1])
    # Two halvings; the finest run stands in for the exact one.
    assert 3.5 < np.log2(coarse / fine) / 2.0 < 4.6


@pytest.mark.slow
@pytest.mark.parametrize(("n_joints", "elbows"), [(4, ()), (5, (3, 5))])
def test_runs_converge_to_the_papers_equations_integrated_elsewhere(n_joints, elbows):
    arm = shortened(uneven_arm(), n_joints)
    start = Simulator(arm, elbows).on_table(arm.nominal_pose)[0]
    voltage = np.random.default_rng(3).uniform(-12.0, 12.0, n_joints)

    def rates(_, state):
        q, q_dot, current = state.reshape(3, n_joints)
        found = dynamics.forward_dynamics(arm, q, q_dot, current, voltage, elbows)
        return np.concatenate([q_dot, found.q_ddot, found.current_dot])

    first = np.concatenate([start, np.zeros(2 * n_joints)])
    exact = solve_ivp(rates, (0.0, 0.02), first, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    for timestep, pose_error, rate_error in ((2e-3, 2e-5, 1e-3), (1e-3, 2e-7, 5e-5), (1e-4, 1e-11, 1e-8)):
        sim = Simulator(arm, elbows, timestep=timestep)
        sim.reset(start)
        sim.step(voltage, round(0.02 / timestep))
        np.testing.assert_allclose(sim.q[0], exact[:n_joints], rtol=0.0, atol=pose_error)
        rates_found = np.concatenate([sim.q_dot[0], sim.current[0]])
        np.testing.assert_allclose(rates_found, exact[n_joints:], rtol=0.0, atol=rate_error)

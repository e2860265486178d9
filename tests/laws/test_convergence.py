"""Runs converge with the timestep: at order 4, to each other, and to the paper's equations integrated elsewhere."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from elbow_gym import Simulator, dynamics
from elbow_gym.simulation.step_limit import INTEGRATORS
from tests.support.arms import ELBOWS, shortened, started, uneven_arm


def run(elbows, timestep, integrator, duration=0.1):
    """The paper's arm after some time under random voltages."""
    sim = Simulator("paper", elbows, timestep=timestep, integrator=integrator)
    voltage = started(sim, 1).uniform(-24.0, 24.0, 10)
    sim.step(voltage, round(duration / timestep))
    return sim


def state(sim):
    """Angles, rates and currents."""
    return np.concatenate([sim.q[0], sim.q_dot[0], sim.current[0]])


def joules(sim):
    """Energies since the start [J], by motor."""
    return np.concatenate([sim.electrical_energy[0], sim.copper_loss[0], sim.friction_loss[0], sim.link_work[0]])


MOST_ELBOWS = (3, 5, 8)
WHOLE = [("exponential", elbows, 2.5e-4, 0.1) for elbows in (*ELBOWS, MOST_ELBOWS)]
SHORT = [("rk4", elbows, 1e-3, 0.01) for elbows in (0, 2, MOST_ELBOWS)]
COMPILED = [pytest.param("rk4", *how, marks=pytest.mark.soak) for _, *how in WHOLE]


@pytest.mark.parametrize(("integrator", "elbows", "longest", "duration"), [*WHOLE, *SHORT, *COMPILED])
def test_halving_the_timestep_divides_the_error_by_sixteen(integrator, elbows, longest, duration):
    ends = [state(run(elbows, longest / 4**k, integrator, duration)) for k in range(3)]
    coarse, fine = (np.linalg.norm(found - ends[-1]) for found in ends[:-1])
    # Two halvings; the finest run stands in for the exact one.
    assert 3.5 < np.log2(coarse / fine) / 2.0 < 4.6


BRIEF = [(elbows, 0.02) for elbows in (0, 2)]
LONG = [pytest.param(elbows, 0.1, marks=pytest.mark.soak) for elbows in ELBOWS]


@pytest.mark.parametrize(("elbows", "duration"), BRIEF + LONG)
def test_both_integrators_converge_to_the_same_run(elbows, duration):
    # Both are off by less than 2e-10 at this step; a method of order 3 would be off by 5e-9.
    exponential, classical = (run(elbows, 6.25e-5, integrator, duration) for integrator in INTEGRATORS)
    np.testing.assert_allclose(state(exponential), state(classical), rtol=0.0, atol=5e-10)
    np.testing.assert_allclose(joules(exponential), joules(classical), rtol=0.0, atol=5e-9)


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

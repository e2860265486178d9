"""Rigid elbows stay on the table, in place and in velocity, under the worst voltages."""

import numpy as np
import pytest

from elbow_gym import Simulator, kinematics
from tests.support.arms import started


@pytest.mark.parametrize("elbows", [1, 2, (3, 5), (5,), (4, 7, 9)], ids=str)
def test_elbows_stay_on_the_table_through_half_a_minute_of_full_voltage(elbows):
    sim = Simulator("paper", elbows, timestep=0.002)
    rng = started(sim)
    for _ in range(600):
        sim.step(24.0 * rng.choice([-1.0, 1.0], 10), 25)
        assert sim.valid.all()
        assert np.abs(kinematics.elbow_heights(sim.arm, sim.q, sim.elbows)).max() <= 1e-12
        rise = kinematics.constraint_jacobian(sim.arm, sim.q[0], sim.elbows) @ sim.q_dot[0]
        assert np.abs(rise).max() <= 1e-5
    assert sim.time[0] == pytest.approx(30.0)
    assert np.abs(sim.q).max() > 2.0 * np.pi


@pytest.mark.parametrize(("volts", "told"), [(24.0, False), (500.0, True)])
def test_steps_that_do_not_resolve_the_elbows_are_told(volts, told):
    sim = Simulator("paper", 2, timestep=0.005)
    rng, residuals = np.random.default_rng(0), []
    for _ in range(50):
        sim.step(volts * rng.choice([-1.0, 1.0], 10), 4)
        residuals.append(sim.constraint_residual[0])
    assert (max(residuals) > 100.0) == told
    assert max(residuals) > 100.0 or max(residuals) < 1e-9

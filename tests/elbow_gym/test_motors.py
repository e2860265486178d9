"""Gear friction brakes, windings warm to where they shed what they take, a loaded supply sags."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from scipy.integrate import solve_ivp

from elbow_gym import dynamics, motors, paper_arm
from tests.support.strategies import between, vectors


def with_motors(arm, **change):
    return replace(arm, motors=tuple(replace(motor, **change) for motor in arm.motors))


@given(vectors(10, 50.0))
def test_gear_friction_only_brakes(q_dot):
    arm = with_motors(paper_arm(), gear_coulomb_friction=0.02)
    torque = motors.coulomb_friction(arm, q_dot)
    assert (torque * q_dot <= 0.0).all()
    assert (np.abs(torque) <= 0.06).all()


def test_gear_friction_is_t_c_k_at_speed_and_less_when_creeping(arm):
    arm = with_motors(arm, gear_coulomb_friction=0.02)
    q_dot = np.array([5.0, -5.0, 0.05, -0.05, 0.0, 1e-4, -1e-4, 50.0, -50.0, 0.0])
    # At the smoothing rate 0.05 rad/s the sign is 1 / sqrt 2; far below it grows as q_dot / 0.05.
    half, creep = np.sqrt(0.5), 0.002
    expected = -0.06 * np.array([1.0, -1.0, half, -half, 0.0, creep, -creep, 1.0, -1.0, 0.0])
    np.testing.assert_allclose(motors.coulomb_friction(arm, q_dot), expected, rtol=6e-5, atol=1e-15)


def test_gear_friction_is_part_of_the_torque_that_reaches_the_link_and_slows_the_joint(arm):
    rough, rng = with_motors(arm, gear_coulomb_friction=0.02), np.random.default_rng(2)
    q, q_dot, q_ddot, current, voltage = rng.normal(size=(5, 10))
    gear = motors.coulomb_friction(rough, q_dot)
    with_gear, without = (dynamics.motor_torque(which, q_dot, q_ddot, current) for which in (rough, arm))
    np.testing.assert_allclose(with_gear - without, gear, atol=1e-15)
    found, smooth = (dynamics.forward_dynamics(which, q, q_dot, current, voltage) for which in (rough, arm))
    np.testing.assert_allclose(
        dynamics.mass_matrix(arm, q) @ (found.q_ddot - smooth.q_ddot), gear, rtol=0.0, atol=1e-12
    )
    np.testing.assert_array_equal(found.current_dot, smooth.current_dot)


def test_a_warm_winding_resists_by_coppers_coefficient(arm):
    rise = np.linspace(0.0, 90.0, 10)
    np.testing.assert_allclose(motors.armature_resistance(arm, rise), 1.1 * (1.0 + 0.00393 * rise), rtol=1e-15)
    still, current = np.zeros(10), np.full(10, 2.0)
    found = dynamics.forward_dynamics(arm, still, still, current, still, temperature_rise=rise)
    np.testing.assert_allclose(found.current_dot, -1.1 * (1.0 + 0.00393 * rise) * 2.0 / 0.0017, rtol=1e-13)


@pytest.mark.parametrize("current", [0.5, 2.0, 3.5])
def test_a_held_current_warms_the_winding_to_where_it_sheds_what_it_takes(arm, current):
    # T = i^2 R (1 + alpha T) R_th, solved for T; 3.5 A comes close to the current beyond which copper runs away.
    cold = current**2 * 1.1 * 5.0
    steady = cold / (1.0 - 0.00393 * cold)
    rate = motors.temperature_rate(arm, np.full(10, current), steady)
    np.testing.assert_allclose(rate, 0.0, atol=1e-13)
    assert (motors.temperature_rate(arm, np.full(10, current), 0.99 * steady) > 0.0).all()
    assert (motors.temperature_rate(arm, np.full(10, current), 1.01 * steady) < 0.0).all()


def test_an_unpowered_winding_cools_with_time_constant_r_th_c_th(arm):
    cooled = solve_ivp(
        lambda _, rise: motors.temperature_rate(arm, np.zeros(10), rise), (0.0, 100.0), np.full(10, 60.0), rtol=1e-9
    )
    # R_th C_th = 5 K/W * 20 J/K = 100 s.
    np.testing.assert_allclose(cooled.y[:, -1], 60.0 / np.e, rtol=1e-7)


def test_a_loaded_supply_sags_by_its_resistance_times_the_bus_current():
    # Duties 1/2 and -1/4 of 24 V at 4 A and 2 A: the bus gives 2 - 0.5 = 1.5 A and drops to 24 - 0.4 * 1.5 V.
    command, current = [12.0, -6.0], [4.0, 2.0]
    assert motors.bus_current(command, current, 24.0) == pytest.approx(1.5, rel=1e-15)
    np.testing.assert_allclose(motors.terminal_voltage(command, current, 24.0, 0.4), [11.7, -5.85], rtol=1e-15)


def test_without_regeneration_the_supply_takes_no_current_back():
    command, current = [12.0], [-4.0]
    assert motors.bus_current(command, current, 24.0) == -2.0
    np.testing.assert_allclose(motors.terminal_voltage(command, current, 24.0, 0.5), [12.5], rtol=1e-15)
    assert motors.bus_current(command, current, 24.0, regeneration=False) == 0.0
    np.testing.assert_array_equal(motors.terminal_voltage(command, current, 24.0, 0.5, regeneration=False), command)


@given(vectors(5, 24.0), vectors(5, 20.0), between(0.0, 0.5))
def test_what_the_supply_gives_reaches_the_motors_or_is_lost_in_its_resistance(command, current, resistance):
    drawn = motors.bus_current(command, current, 24.0)
    at_motors = motors.terminal_voltage(command, current, 24.0, resistance) @ current
    assert 24.0 * drawn == pytest.approx(at_motors + resistance * drawn**2, rel=1e-12, abs=1e-12)


def test_a_stiff_supply_gives_what_the_controller_asks_for():
    command, current = np.linspace(-24.0, 24.0, 10), np.arange(10.0)
    np.testing.assert_array_equal(motors.terminal_voltage(command, current, 24.0, 0.0), command)

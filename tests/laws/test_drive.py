"""Motors and supply beyond the paper's in whole runs: warm windings, a sagging bus, gears and elbows that rub."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from elbow_gym import Conditions, MotorParameters, Simulator, kinematics, motors, paper_arm
from elbow_gym.simulation.parameter_rows import parameter_table
from elbow_gym.simulation.rates import rates
from elbow_gym.simulation.step_limit import limits

# Rotors too heavy to move and hardly driven: L di/dt = v - R i alone.
STALLED = MotorParameters(rotor_inertia=1e12, torque_constant=1e-200)


def stalled(motor=STALLED, timestep=5e-4, **conditions):
    """An arm whose motors stand still."""
    arm = replace(paper_arm(), motors=(motor,) * 10)
    return Simulator(arm, 0, conditions=Conditions(**conditions), timestep=timestep)


def test_a_stalled_motors_winding_approaches_its_steady_rise_at_its_own_rate():
    # Without a temperature coefficient: T = R_th R i^2 (1 - exp(-t / (R_th C_th))), here R_th C_th = 0.2 s.
    motor = replace(STALLED, thermal_resistance=2.0, heat_capacity=0.1, temperature_coefficient=0.0)
    sim = stalled(motor, heat=True)
    voltage = np.linspace(1.0, 10.0, 10)
    sim.reset(current=voltage / 1.1)
    steady = 2.0 * voltage**2 / 1.1
    for time in (0.2, 0.4, 4.0):
        sim.step(voltage, round((time - sim.time[0]) / 5e-4))
        np.testing.assert_allclose(sim.temperature_rise[0], steady * (1.0 - np.exp(-time / 0.2)), rtol=1e-6)


def test_a_warm_winding_draws_less_and_settles_where_cooling_meets_its_copper_loss():
    # T = R_th v^2 / (R (1 + alpha T)), so alpha T^2 + T - R_th v^2 / R = 0.
    motor = replace(STALLED, thermal_resistance=2.0, heat_capacity=0.05)
    sim = stalled(motor, heat=True)
    voltage = np.linspace(1.0, 10.0, 10)
    sim.step(voltage, 4000)
    rise = (np.sqrt(1.0 + 4.0 * 0.00393 * 2.0 * voltage**2 / 1.1) - 1.0) / (2.0 * 0.00393)
    np.testing.assert_allclose(sim.temperature_rise[0], rise, rtol=1e-6)
    np.testing.assert_allclose(sim.current[0], voltage / (1.1 * (1.0 + 0.00393 * rise)), rtol=1e-6)
    assert rise[-1] > 100.0


def test_heat_in_the_winding_is_copper_loss_less_what_left_it():
    # With a cooling path that hardly conducts, all copper loss stays: C_th T.
    # The meter takes v i - (L i^2 / 2)_dot, the temperature R i^2 by stages: equal to order 4, 5e-7 at 0.5 ms.
    sim = stalled(replace(STALLED, thermal_resistance=1e12), timestep=5e-5, heat=True)
    sim.step(np.linspace(-24.0, 24.0, 10), 2000)
    np.testing.assert_allclose(20.0 * sim.temperature_rise, sim.copper_loss, rtol=1e-9)
    assert sim.temperature_rise.max() > 1.0


def test_windings_keep_their_temperature_at_a_reset_that_says_so():
    sim = stalled(heat=True)
    sim.reset(temperature_rise=np.full(10, 60.0))
    sim.step(np.ones(10), 40)
    # 20 ms are little beside R_th C_th = 100 s.
    np.testing.assert_allclose(sim.temperature_rise, 60.0, rtol=1e-3)
    np.testing.assert_allclose(sim.current, 1.0 / (1.1 * (1.0 + 0.00393 * 60.0)), rtol=1e-3)
    with pytest.raises(ValueError, match=r"^temperature_rise must be zero unless heat is True, got 60 K$"):
        stalled(supply_resistance=0.1).reset(temperature_rise=np.full(10, 60.0))


@pytest.mark.parametrize(("supply_voltage", "supply_resistance"), [(24.0, 0.1), (48.0, 0.5)])
def test_a_stalled_motor_pulls_the_bus_down_as_ohms_law_says(supply_voltage, supply_resistance):
    # Duty d = u / V0, I = d i and v = d (V0 - R_s I): a load of R / d^2 in series with R_s.
    sim = stalled(supply_voltage=supply_voltage, supply_resistance=supply_resistance)
    command, duty = 12.0 * np.eye(10)[4], 12.0 / supply_voltage
    drawn = supply_voltage / (1.1 / duty**2 + supply_resistance)
    sim.reset(current=drawn / duty * np.eye(10)[4])
    sim.step(command, 200)
    assert sim.current[0, 4] == pytest.approx(drawn / duty, rel=1e-9)
    assert sim.supply_loss[0] == pytest.approx(0.1 * supply_resistance * drawn**2, rel=1e-9)
    assert sim.electrical_energy[0, 4] == pytest.approx(0.1 * 1.1 * (drawn / duty) ** 2, rel=1e-9)


def test_a_supply_that_takes_nothing_back_stays_at_its_voltage():
    # v = -1 V against 20 A that stay positive for 5 ms: fed back, or burnt in the chopper.
    losses = []
    for regeneration in (True, False):
        sim = stalled(timestep=2.5e-4, supply_resistance=1.0, regeneration=regeneration)
        sim.reset(current=np.full(10, 20.0))
        sim.step(np.full(10, -1.0), 8)
        losses.append(sim.supply_loss[0])
        assert (sim.electrical_energy < 0.0).all()
    assert losses[0] > 0.0 == losses[1]


def rough_yaw(coulomb):
    """The paper's arm, upright, whose yaw gear sticks."""
    arm = paper_arm()
    sim = Simulator(replace(arm, motors=(MotorParameters(gear_coulomb_friction=coulomb), *arm.motors[1:])), 0)
    sim.reset(np.zeros(10))
    return sim


@pytest.mark.parametrize("share", [0.5, 0.9, 3.0])
def test_a_gears_coulomb_friction_holds_against_less_and_yields_to_more(share):
    coulomb = 0.005
    sim = rough_yaw(coulomb)
    held = 3.0 * coulomb
    voltage = share * held * 1.1 / 0.609
    sim.step(voltage * np.eye(10)[0], 200)
    speed = sim.q_dot[0, 0]

    def surplus(rate):
        drive = 0.609 * (voltage - 0.609 * rate) / 1.1
        return drive - 0.59 * rate - held * rate / np.hypot(rate, motors.COULOMB_VELOCITY)

    assert speed == pytest.approx(brentq(surplus, 0.0, 10.0, xtol=1e-14), rel=1e-6)
    if share < 1.0:
        # Creep: where friction alone, s(w) = share, would hold the torque.
        assert 0.0 < speed < motors.COULOMB_VELOCITY * share / np.sqrt(1.0 - share**2)
    free = share * held / (0.59 + 0.609**2 / 1.1)
    assert speed < free


@pytest.mark.parametrize(
    ("motor", "conditions", "integrator", "message"),
    [
        ({"gear_coulomb_friction": 0.05}, {}, "exponential", "at most 0.000905 s, for the rate 'friction'"),
        # R / L = 2200 / s, which only the classical method has to resolve.
        ({"armature_inductance": 0.0005}, {}, "rk4", "at most 0.000636 s, for the rate 'armature' of 2200"),
        ({"armature_inductance": 0.0005}, {"table": True}, "exponential", "at most 0.000784 s, for the rate 'table'"),
    ],
)
def test_a_step_too_long_for_what_is_fastest_is_refused(motor, conditions, integrator, message):
    arm = replace(paper_arm(), motors=(MotorParameters(**motor),) * 10)
    with pytest.raises(ValueError, match=rf"^timestep must be {re.escape(message)} .*, got 0\.002$"):
        Simulator(arm, 0, conditions=Conditions(**conditions), timestep=0.002, integrator=integrator)


def test_a_rough_gear_at_the_longest_step_that_is_allowed_comes_to_rest():
    arm = replace(paper_arm(), motors=(MotorParameters(gear_coulomb_friction=0.05),) * 10)
    limit, _ = limits(rates(parameter_table(arm, Conditions()), Conditions(), elbows=False), "exponential")
    sim = Simulator(arm, 0, timestep=limit)
    sim.reset(np.zeros(10), np.eye(10)[0])
    sim.step(np.zeros(10), 200)
    assert np.abs(sim.q_dot).max() < 1e-6


@pytest.mark.parametrize("elbows", [1, 2])
def test_an_arm_slides_less_far_on_rubbing_elbows(elbows):
    ways = []
    for friction in (0.0, 0.1, 0.3):
        sim = Simulator("paper", elbows, conditions=Conditions(elbow_friction=friction), timestep=5e-4)
        sim.reset(q_dot=2.0 * np.eye(10)[0])
        sim.step(np.zeros(10), 400)
        ways.append(sim.q[0, 0])
        assert (sim.contact_loss > 0.0).any() == (friction > 0.0)
        assert np.abs(kinematics.elbow_heights(sim.arm, sim.q, sim.elbows)).max() < 1e-12
    assert ways[0] > ways[1] > ways[2] > 0.0

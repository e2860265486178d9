"""The expanded reward against differences of it, and the recursion against the minimum that it says it finds."""

from dataclasses import dataclass

import numpy as np
import pytest

from agents.control.expansion import MeanPower, hand_jacobian, riccati, tracking
from elbow_gym import Simulator
from elbow_gym.kinematics import hand_position
from elbow_gym.task.settings import Settings

RNG = np.random.default_rng(7)


def test_hand_jacobian_is_the_hands_slope(arm):
    q, step = np.array(arm.nominal_pose) + RNG.normal(size=(3, 10)), 1e-6
    expected = np.stack(
        [(hand_position(arm, q + step * e) - hand_position(arm, q - step * e)) / (2 * step) for e in np.eye(10)], -1
    )
    np.testing.assert_allclose(hand_jacobian(arm, q), expected, atol=1e-9)


def test_tracking_slopes_are_those_of_the_smoothed_distance(arm):
    settings, q, step = Settings(tracking_weight=2.0), np.array(arm.nominal_pose) + RNG.normal(size=10), 1e-6
    target = hand_position(arm, q) + np.array([0.01, -0.02, 0.005])
    cost, slope, curvature = tracking(settings, q, target, 0.03)
    assert cost == pytest.approx(2.0 * np.sqrt(0.01**2 + 0.02**2 + 0.005**2 + 0.03**2))
    around = [[tracking(settings, q + s * step * e, target, 0.03) for s in (1, -1)] for e in np.eye(10)]
    np.testing.assert_allclose(slope, [(up[0] - down[0]) / (2 * step) for up, down in around], atol=1e-8)
    # On the target the curvature of the hand's path drops out, and Gauss-Newton's is exact.
    on_target = [
        [tracking(settings, q + s * step * e, hand_position(arm, q), 0.03)[1] for s in (1, -1)] for e in np.eye(10)
    ]
    expected = np.array([(up - down) / (2 * step) for up, down in on_target])
    np.testing.assert_allclose(tracking(settings, q, hand_position(arm, q), 0.03)[2], expected, atol=1e-5)
    assert np.linalg.eigvalsh(curvature).min() > -1e-9


def test_mean_power_is_the_simulators(arm):
    settings = Settings(duration=0.06, energy_weight=0.01)
    simulator, states, volts = Simulator(arm, 2, 1), [], RNG.uniform(-20.0, 20.0, size=(3, 10))
    for voltage in (None, *volts):
        if voltage is not None:
            simulator.advance(voltage[None].copy(), settings.substeps)
        states.append(np.concatenate([simulator.q[0], simulator.q_dot[0], simulator.current[0]]))
    energy = simulator.electrical_energy.sum()
    assert MeanPower(settings).cost(np.array(states), volts) == pytest.approx(0.01 * energy / 0.02, rel=1e-3)


@dataclass
class Linear:
    """A linear system of two joints over three periods around a plan, and its cost."""

    slopes: tuple
    curvature: np.ndarray
    slope: np.ndarray
    states: np.ndarray
    voltage: np.ndarray
    power: MeanPower

    def cost(self, steps, gains):
        deviation, cost = np.zeros(6), 0.0
        change = np.diff(self.states, axis=0)
        for k in range(3):
            volts = steps[k] - gains[k] @ deviation
            after = self.slopes[0][k] @ deviation + self.slopes[1][k] @ volts
            applied = self.voltage[k] + volts
            moved = change[k] + after - deviation
            cost += (self.power.price * applied * (applied - self.power.change @ moved)).sum()
            deviation = after
            q = deviation[:2]
            cost += self.slope[k] @ q + q @ self.curvature[k] @ q / 2.0
        return cost


@pytest.fixture
def linear():
    power = object.__new__(MeanPower)
    power.price, power.change = np.array([1.0, 2.0]), 0.1 * RNG.normal(size=(2, 6))
    spread = RNG.normal(size=(3, 2, 2))
    return Linear(
        (RNG.normal(size=(3, 6, 6)), RNG.normal(size=(3, 6, 2))),
        spread @ np.swapaxes(spread, 1, 2),
        RNG.normal(size=(3, 2)),
        RNG.normal(size=(4, 6)),
        RNG.normal(size=(3, 2)),
        power,
    )


def found(linear, **options):
    planned = linear.states, linear.voltage
    return riccati(linear.slopes, linear.power, linear.curvature, linear.slope, planned, **options)


def test_no_other_steps_or_gains_are_cheaper(linear):
    steps, gains = found(linear)
    least = linear.cost(steps, gains)
    for k in range(3):
        for e in np.eye(2):
            nudge = np.zeros_like(steps)
            nudge[k] = 1e-3 * e
            assert least < linear.cost(steps + nudge, gains)
            assert least < linear.cost(steps - nudge, gains)
    assert linear.cost(steps, 0.9 * gains) > least


def test_limited_steps_stay_within_the_limit_and_are_cheaper_than_cut_ones(linear):
    free, _ = found(linear)
    limit = 0.5 * np.abs(linear.voltage + free).max()
    steps, held = found(linear, limit=limit)
    applied = linear.voltage + steps
    assert np.abs(applied).max() == pytest.approx(limit)
    at_limit = np.abs(applied) > limit - 1e-9
    assert at_limit.any()
    assert not at_limit.all()
    assert not held[at_limit].any()
    assert found(linear, limit=100.0)[0] == pytest.approx(free)
    assert np.abs(found(linear, stiffness=1e6)[0]).max() < 1e-4


def test_a_cost_without_a_minimum_is_said_to_have_none(linear):
    linear.power.price = -linear.power.price
    linear.curvature = 0.0 * linear.curvature
    with pytest.raises(np.linalg.LinAlgError):
        found(linear)

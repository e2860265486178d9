"""The time-varying LQR: linearised periods are the simulator's, and the last gain is the best answer to a deviation."""

import numpy as np
import pytest

from agents.control import lqr
from agents.control.lqr import Linearisation, TimeVaryingLQR, lqr_gains
from agents.control.trajectory import Trajectory
from elbow_gym import Simulator
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv
from tests.support.trajectories import resting


@pytest.mark.parametrize(("elbows", "payload"), [(0, 0.0), (2, 0.0), (0, 1.0)])
def test_linearised_period_predicts_the_simulators_next_state(arm, elbows, payload):
    settings, trajectory = Settings(elbows=elbows, duration=0.1, payload=payload), resting(arm)
    A, B = Linearisation(settings, 5)(trajectory.states[:-1], trajectory.voltage)
    simulator = Simulator(arm, elbows, 2, conditions=settings.conditions)
    rng = np.random.default_rng(0)
    current, voltage = 1e-3 * rng.normal(size=10), 1e-3 * rng.normal(size=10)
    poses = simulator.on_table(np.array([arm.nominal_pose, arm.nominal_pose + 1e-4 * rng.normal(size=10)]))
    simulator.reset(poses, current=np.stack([np.zeros(10), current]))
    simulator.advance(np.stack([np.zeros(10), voltage]), settings.substeps)
    after = np.concatenate([simulator.q, simulator.q_dot, simulator.current], axis=-1)
    deviation = np.concatenate([poses[1] - poses[0], np.zeros(10), current])
    np.testing.assert_allclose(A[0] @ deviation + B[0] @ voltage, after[1] - after[0], atol=2e-5)
    one_sided = Linearisation(settings, 5, central=False)(trajectory.states[:-1], trajectory.voltage)
    np.testing.assert_allclose(
        np.concatenate(one_sided, axis=-1), np.concatenate([A, B], axis=-1), rtol=1e-3, atol=1e-3
    )


def test_slopes_of_arms_that_take_turns_are_each_its_own(arm):
    trajectory, loads = resting(arm), (0.0, 0.3)
    each = [Settings(duration=0.1, payload=payload) for payload in loads]
    alone = [Linearisation(one, 5, central=False)(trajectory.states[:-1], trajectory.voltage) for one in each]
    parameters = np.stack([Simulator(arm, 2, conditions=one.conditions).parameters(np.array([0]))[0] for one in each])
    states, voltage = (np.repeat(part, 2, axis=0) for part in (trajectory.states[:-1], trajectory.voltage))
    both = Linearisation(each[0], 10, central=False, arms=2)(states, voltage, parameters)
    for k in range(2):
        for own, found in zip(alone[k], both, strict=True):
            np.testing.assert_allclose(found[k::2], own, atol=1e-9)
    assert np.abs(alone[0][1] - alone[1][1]).max() > 1e-6


def test_lqr_without_a_deviation_gives_the_planned_voltage(arm):
    trajectory = resting(arm)
    trajectory.voltage[:] = 3.0
    env = ElbowArmVectorEnv(1, duration=0.1, start_noise=0.0)
    observation, _ = env.reset(seed=0)
    action, _ = TimeVaryingLQR(env, trajectory).predict(observation)
    np.testing.assert_allclose(action, 3.0 / 24.0, atol=1e-6)


def test_trajectory_of_another_length_than_the_episode_is_refused(arm):
    with pytest.raises(ValueError, match="trajectory must have 250 control periods, got 5"):
        TimeVaryingLQR(ElbowArmVectorEnv(1), resting(arm))


def slopes_of_cost(settings, state, voltage, planned):
    """Slopes of the last period's cost in its voltages [1/V], (n,), by central differences of the simulator.

    The cost is the LQR's: mean power, the smoothed distance from the target, and the distance from the planned pose.
    """
    nudge = np.concatenate([np.eye(10), -np.eye(10)]) * 1e-3
    simulator = Simulator(settings.parsed_arm, settings.elbow_joints, 20)
    simulator.reset(*np.split(state, 3))
    simulator.advance(voltage + nudge, settings.substeps)
    circle = settings.parsed_circle
    error = simulator.hand_position - circle.position(circle.angle(settings.duration, float(circle.phase)))
    distance = np.sqrt((error**2).sum(axis=1) + lqr.SMOOTHING**2)
    posture = lqr.STIFFNESS / 2.0 * ((simulator.q - planned) ** 2).sum(axis=1)
    power = simulator.electrical_energy.sum(axis=1) / settings.control_period
    cost = settings.tracking_weight * (distance + posture) + settings.energy_weight * power
    return (cost[:10] - cost[10:]) / 2e-3


def test_last_gain_is_the_best_answer_to_a_deviation_in_the_last_period(arm, monkeypatch):
    # All three prices count about as much as each other.
    monkeypatch.setattr(lqr, "STIFFNESS", 20.0)
    start, zero = np.concatenate([arm.nominal_pose, np.zeros(20)]), np.zeros(10)
    simulator = Simulator(arm, 0)
    simulator.reset(arm.nominal_pose)
    simulator.step(zero, 10)
    ended = simulator.q[0].copy()
    # The target is where the falling arm's hand is after the one period: there the LQR's expansion is exact.
    circle = {"center": (simulator.hand_position[0] - [1e-3, 0.0, 0.0]).tolist(), "radius": 1e-3, "period": 1e6}
    settings = Settings(elbows=0, duration=0.02, circle=circle, energy_weight=0.02)
    trajectory = Trajectory(np.stack([arm.nominal_pose, ended]), *np.zeros((2, 2, 10)), np.zeros((1, 10)))
    (gain,) = lqr_gains(settings, trajectory)
    on_plan = slopes_of_cost(settings, start, zero, ended)
    for deviation in 1e-5 * np.random.default_rng(1).normal(size=(3, 30)):
        answered, unanswered = (
            slopes_of_cost(settings, start + deviation, voltage, ended) - on_plan
            for voltage in (-gain @ deviation, zero)
        )
        assert np.abs(answered).max() < 0.002 * np.abs(unanswered).max()

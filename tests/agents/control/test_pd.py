"""The PD controller against its law, through the environment alone."""

import numpy as np
import pytest

from elbow_gym.baselines.pd import CLIPPED, PDController
from elbow_gym.kinematics import hand_position
from elbow_gym.vector_env import ElbowArmVectorEnv


def volts_env(num_envs=3, **more):
    settings = {"action_unit": "volt", "voltage_limit": 1000.0, "control_frequency": 1000.0}
    return ElbowArmVectorEnv(num_envs, **{**settings, **more})


def test_pd_voltage_is_the_papers_law():
    env = volts_env(elbows=0, circle={"phase": "random"})
    env.reset(seed=1)
    rng = np.random.default_rng(0)
    q_dot = rng.normal(size=(3, 10))
    observation, _ = env.reset(options={"state": {"q": env.episodes.pose + 0.1, "q_dot": q_dot}})
    pd = PDController(env)
    q_d, q_d_dot = pd.desired(env.episodes.angle())
    expected = 500.0 * (q_d - env.episodes.pose - 0.1) + 20.0 * (q_d_dot - q_dot)
    action, state = pd.predict(observation)
    assert state is None
    np.testing.assert_allclose(action, expected, atol=2e-3)


def test_desired_pose_puts_the_hand_on_the_target_and_moves_three_joints_alone():
    env = volts_env()
    pd = PDController(env)
    angle = np.linspace(0.0, 6.0, 13)
    q_d, q_d_dot = pd.desired(angle)
    circle = env.episodes.circle
    np.testing.assert_allclose(hand_position(env.episodes.arm, q_d), circle.position(angle), atol=1e-12)
    np.testing.assert_array_equal(q_d[:, 1:8], np.tile(env.episodes.pose[1:8], (13, 1)))
    np.testing.assert_array_equal(q_d_dot[:, 1:8], 0.0)


def test_desired_rates_are_the_exact_derivative():
    pd = PDController(volts_env())
    angle, step, rate = np.linspace(0.0, 6.0, 13), 1e-6, 2 * np.pi / 5
    ahead, behind = pd.desired(angle + step)[0], pd.desired(angle - step)[0]
    np.testing.assert_allclose(pd.desired(angle)[1], (ahead - behind) / (2 * step) * rate, atol=1e-8)


def test_action_in_fractions_is_the_clipped_voltage_over_the_supply():
    env, volts = ElbowArmVectorEnv(2, voltage_limit=24.0), volts_env(num_envs=2)
    observation, _ = env.reset(seed=0)
    wanted, _ = PDController(volts).predict(volts.reset(seed=0)[0])
    action, _ = PDController(env).predict(observation)
    np.testing.assert_allclose(action, np.clip(wanted / 24.0, -1.0, 1.0), atol=1e-4)
    # Some joints want more than there is: the start is 0.75 rad of yaw away from the target, 377 V.
    assert (np.abs(wanted) > 24.0).any()
    assert (np.abs(wanted) < 24.0).any()


def test_circle_out_of_the_last_links_reach_is_refused_with_the_distance():
    env = ElbowArmVectorEnv(1, circle={"center": [0.5, 0.5, 0.4]})
    with pytest.raises(ValueError, match=r"reach of the last two links, got a point 0\.\d+ m outside"):
        PDController(env)


@pytest.mark.parametrize("gain", ["kp", "kd"])
def test_gains_must_be_positive(gain):
    with pytest.raises(ValueError, match=rf"{gain} must be positive, got -1\.0"):
        PDController(volts_env(), **{gain: -1.0})


def test_the_pd_goes_on_where_the_target_crosses_the_half_turn_of_joint_1():
    circle = {"center": [-1.5 * np.sqrt(2.0), 0.0, 0.4], "phase": -0.05}
    env = ElbowArmVectorEnv(1, **CLIPPED, circle=circle, start="on_target", start_noise=0.0)
    observation, _ = env.reset(seed=0)
    pd = PDController(env)
    desired = [pd.desired(env.episodes.angle())[0][0, 0]]
    for _ in range(200):
        observation, *_, info = env.step(pd.predict(observation)[0])
        desired.append(pd.desired(env.episodes.angle())[0][0, 0])
    # The angle itself jumps by a turn there, since it is an arc tangent.
    assert np.abs(np.diff(desired)).max() > 6.0
    assert info["tracking_error"][0] < 0.02
    assert info["electrical_energy"][0] < 20.0

"""Interface of the environments to controllers: one meaning of its parts for single, batched and wrapped ones."""

import gymnasium as gym
import numpy as np
import pytest

from elbow_gym import Interface, PDController

RANDOM = {"circle": {"radius": [0.05, 0.15], "period": [4.0, 6.0], "phase": "random", "direction": "random"}}
MAKERS = {
    "single": lambda **options: gym.make("ElbowArm-v0", **options).unwrapped,
    "wrapped": lambda **options: gym.wrappers.RecordEpisodeStatistics(gym.make("ElbowArm-v0", **options)),
    "batch": lambda **options: gym.make_vec("ElbowArm-v0", num_envs=3, **options),
    "wrapped batch": lambda **options: gym.wrappers.vector.RecordEpisodeStatistics(
        gym.make_vec("ElbowArm-v0", num_envs=3, **options)
    ),
}
each_kind = pytest.mark.parametrize("kind", MAKERS)
each_circle = pytest.mark.parametrize("options", [{}, RANDOM], ids=["circle", "drawn circles"])


def moving(kind, **options):
    """An environment after ten periods of random actions, its interface, simulator, last observation and info."""
    env = MAKERS[kind](elbows=1, **options)
    observation, _ = env.reset(seed=3)
    rng = np.random.default_rng(0)
    for _ in range(10):
        action = rng.uniform(-0.3, 0.3, env.action_space.shape) * env.action_space.high
        observation, _, _, _, info = env.step(action.astype(np.float32))
    return env, Interface(env), env.unwrapped.episodes.simulator, observation, info


@each_kind
@each_circle
def test_observed_parts_are_the_simulators_state_and_the_target(kind, options):
    _, interface, simulator, observation, info = moving(kind, **options)
    observed = interface.decode(observation)
    np.testing.assert_allclose(np.atleast_2d(interface.joint_angles(observed)), simulator.q, atol=1e-6)
    np.testing.assert_allclose(np.atleast_2d(observed["joint_velocity"]), simulator.q_dot, atol=1e-5)
    np.testing.assert_allclose(np.atleast_2d(observed["current"]), simulator.current, atol=1e-5)
    position, _ = interface.target(interface.target_angle(observed))
    assert position.shape == (*observation.shape[:-1], 3)
    np.testing.assert_allclose(np.atleast_2d(position), simulator.hand_position - observed["hand_error"], atol=1e-6)
    error = np.linalg.norm(np.atleast_2d(position) - simulator.hand_position, axis=-1)
    np.testing.assert_allclose(error, info["tracking_error"], atol=1e-6)


@each_kind
@each_circle
def test_target_moves_at_its_velocity(kind, options):
    _, interface, _, observation, _ = moving(kind, **options)
    angle, step = interface.target_angle(interface.decode(observation)), 1e-4
    change = interface.target_rate * step
    ahead, behind = (interface.target(turned)[0] for turned in (angle + change, angle - change))
    velocity = interface.target(angle)[1]
    np.testing.assert_allclose(velocity, (ahead - behind) / (2.0 * step), atol=1e-7)
    assert np.linalg.norm(velocity, axis=-1).min() > 0.05
    # Several angles of every arm at once, as for a central difference.
    several = interface.target(np.stack([angle + change, angle]))
    np.testing.assert_array_equal(several[0], [ahead, interface.target(angle)[0]])
    np.testing.assert_array_equal(several[1][1], velocity)


@each_kind
@pytest.mark.parametrize("unit", ["fraction", "volt"])
def test_action_asks_for_volts_and_no_more_than_the_supply(kind, unit):
    env, interface, _, observation, _ = moving(kind, action_unit=unit, voltage_limit=12.0)
    wanted = np.linspace(-15.0, 15.0, 10) + np.zeros((*observation.shape[:-1], 10))
    action = interface.action(wanted)
    assert env.action_space.contains(action)
    np.testing.assert_allclose(env.step(action)[4]["voltage"], np.clip(wanted, -12.0, 12.0), rtol=1e-6)
    assert interface.voltage_limit == 12.0


@each_kind
def test_rates_arm_and_elbows_are_the_environments(kind):
    env, interface, simulator, _, _ = moving(kind, control_frequency=100.0, duration=0.5, timestep=0.002)
    assert (interface.control_period, interface.horizon) == (0.01, 50)
    np.testing.assert_allclose(interface.substeps, np.full(5, 0.002))
    assert interface.elbows == (4,)
    assert interface.arm == simulator.arm
    np.testing.assert_array_equal(interface.pose, simulator.on_table(interface.arm.nominal_pose)[0])
    assert interface.layout.names == env.unwrapped.observation_names


def test_pd_plays_a_single_arm_on_a_drawn_circle_as_in_a_batch_of_one():
    options = {**RANDOM, "control_frequency": 2000.0, "duration": 0.1}
    env, batch = MAKERS["single"](**options), gym.make_vec("ElbowArm-v0", num_envs=1, **options)
    pd, batched = PDController(env), PDController(batch)
    observation, rows = env.reset(seed=5)[0], batch.reset(seed=5)[0]
    for _ in range(100):
        observation, rows = env.step(pd.predict(observation)[0])[0], batch.step(batched.predict(rows)[0])[0]
        np.testing.assert_array_equal(observation, rows[0])


@pytest.mark.parametrize(
    "make",
    [lambda: gym.make("CartPole-v1"), lambda: gym.make_vec("CartPole-v1", num_envs=1, vectorization_mode="sync"), dict],
)
def test_another_environment_is_refused(make):
    with pytest.raises(ValueError, match=r"^env must be an ElbowArmEnv or ElbowArmVectorEnv, wrapped or not, got "):
        Interface(make())

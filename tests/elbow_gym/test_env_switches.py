"""Every switch through the environments: conformance, bounds under the worst voltages, and wrong values named."""

import json

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv

RANGES = {
    "mass": [0.7, 1.3],
    "length": [0.97, 1.1],
    "torque_constant": [0.9, 1.1],
    "supply_voltage": [0.9, 1.1],
    "payload": [0.0, 0.3],
    "sensor_noise": [0.0, 0.01],
    "action_delay": [0, 2],
}
SWITCHES = {
    "table": {"elbows": 0, "table": {"friction": 0.3}},
    "table under rigid elbows": {"elbows": 1, "table": True},
    "elbow friction": {"elbows": 2, "elbow_friction": 0.1},
    "drive": {
        "elbows": 2,
        "heat": True,
        "supply_resistance": 0.2,
        "gear_coulomb_friction": 0.01,
        "regeneration": False,
    },
    "everything": {
        "elbows": 2,
        "table": {"friction": 0.1},
        "elbow_friction": 0.1,
        "heat": True,
        "supply_resistance": 0.1,
        "gear_coulomb_friction": 0.005,
        "payload": 0.1,
        "randomize": RANGES,
        "circle": {"radius": [0.05, 0.1], "phase": "random", "plane": "random"},
    },
}
IDS = ("ElbowArmTable-v0", "ElbowArmRandom-v0", "ElbowArmTasks-v0")


@pytest.mark.parametrize("name", SWITCHES)
def test_both_checkers_pass_with_every_switch(name):
    check_env(ElbowArmEnv(**SWITCHES[name]), skip_render_check=True)
    sb3 = pytest.importorskip("stable_baselines3.common.env_checker")
    sb3.check_env(ElbowArmEnv(**SWITCHES[name]))


@pytest.mark.parametrize("name", IDS)
def test_registered_tasks_conform_and_round_trip_through_json(name):
    env = gym.make(name)
    check_env(env.unwrapped, skip_render_check=True)
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    np.testing.assert_array_equal(env.reset(seed=1)[0], again.reset(seed=1)[0])
    assert gym.make_vec(name, num_envs=3).unwrapped.__class__ is ElbowArmVectorEnv
    json.dumps(env.unwrapped.settings.arguments)


@pytest.mark.parametrize("name", SWITCHES)
@pytest.mark.parametrize("bang_bang", [False, True])
def test_seventy_thousand_steps_of_the_worst_voltages_stay_within_the_bounds(name, bang_bang):
    arms, periods = 256, 30
    env = ElbowArmVectorEnv(arms, autoreset_mode="SameStep", **SWITCHES[name])
    env.reset(seed=0)
    rng, high = np.random.default_rng(1), env.single_observation_space.high
    ended = 0
    for _ in range(periods):
        action = rng.uniform(-1.0, 1.0, (arms, 10))
        seen, reward, terminated, _, info = env.step(np.sign(action) if bang_bang else action)
        assert np.isfinite(seen).all()
        assert (np.abs(seen) <= high).all()
        assert np.isfinite(reward).all()
        assert all(np.isfinite(info[key]).all() for key in ("contact_loss", "temperature_rise") if key in info)
        ended += int(terminated.sum())
    assert arms * periods * len(env.settings.substeps) > 70_000
    # Friction may jam an elbow where all links under it stand upright; nothing else ends an episode.
    assert ended <= (2 if env.settings.elbow_friction > 0.0 else 0)


def test_a_resets_parameters_are_refused_where_the_environments_steps_are_too_long_for_them():
    env = ElbowArmEnv()
    env.reset(seed=0, options={"parameters": {"joint_viscous_friction": 0.5}})
    message = r"^options\['parameters'\] must allow substeps of 0\.0055 s, got 0\.000638 s at most, for the rate"
    with pytest.raises(ValueError, match=message):
        env.reset(options={"parameters": {"joint_viscous_friction": 5.0}})


def test_resting_on_the_table_is_seen_and_told():
    env = ElbowArmEnv(elbows=0, table=True, start_noise=0.0)
    env.reset(seed=0)
    for _ in range(25):
        seen, _, _, _, info = env.step(np.zeros(10, np.float32))
    normal = info["contact_force"][:, 2]
    assert (normal >= 0.0).all()
    np.testing.assert_array_equal(info["load_bearing"], normal > 0.0)
    assert info["load_bearing"].any()
    np.testing.assert_allclose(env.decode(seen)["contact_force"], normal, rtol=1e-6)


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ({"payload": -0.1}, r"payload must not be negative, got -0\.1"),
        ({"elbow_friction": "much"}, "elbow_friction must be a number, got 'much'"),
        (
            {"elbow_friction": 1.5},
            r"elbow_friction must be at most 1, above which contacts jam .*, got 1\.5",
        ),
        ({"table": 3}, "table must be True, False, a dict of its fields or TableParameters, got 3"),
        ({"table": {"stiffness": 0.0}}, r"table stiffness must be positive, got 0\.0"),
        ({"heat": 1}, "heat must be True or False, got 1"),
        ({"gear_coulomb_friction": -1.0}, r"gear_coulomb_friction must not be negative, got -1\.0"),
        ({"supply_resistance": -1.0}, r"supply_resistance must not be negative, got -1\.0"),
    ],
)
def test_a_wrong_switch_is_named(argument, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        ElbowArmEnv(**argument)


def test_a_hot_motor_is_told():
    env = ElbowArmEnv(heat=True, table=True, elbow_friction=0.1, start_noise=0.0)
    pose = env.episodes.pose
    env.reset(seed=0, options={"state": {"q": pose, "temperature_rise": np.full(10, 101.0)}})
    assert env.step(np.zeros(10, np.float32))[4]["overheated"] is True
    env.reset(seed=0)
    info = env.step(np.zeros(10, np.float32))[4]
    assert info["overheated"] is False
    assert info["temperature_rise"].shape == (10,)

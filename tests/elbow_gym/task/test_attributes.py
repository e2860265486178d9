"""Attributes of an environment: arguments that are fixed, weights that are not, and the horizon in its spec."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import TimeAwareObservation

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv
from elbow_gym.task.attributes import WEIGHTS
from elbow_gym.task.settings import Settings

KINDS = (ElbowArmEnv, ElbowArmVectorEnv)


def action(env, seed=1):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)


def lived(env):
    """Control periods until an episode is over, and whether it was truncated."""
    env.reset(seed=0)
    for count in range(1, 1000):
        *_, terminated, truncated, _ = env.step(np.zeros(env.action_space.shape, np.float32))
        if np.any(terminated) or np.any(truncated):
            return count, bool(np.all(truncated))
    raise AssertionError


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", WEIGHTS)
def test_a_weight_that_is_set_counts_from_the_next_step_on(kind, name):
    env = kind(tracking_weight=0.0, energy_weight=0.0)
    env.reset(seed=0)
    assert not np.any(env.step(action(env))[1])
    setattr(env.unwrapped, name, 5.0)
    assert getattr(env, name) == 5.0
    _, reward, *_, info = env.step(action(env))
    charged = info["tracking_error"] if name == "tracking_weight" else info["electrical_power"]
    np.testing.assert_allclose(reward, -5.0 * charged, rtol=1e-12)
    with pytest.raises(ValueError, match=f"^{name} must not be negative, got -1.0$"):
        setattr(env, name, -1.0)
    assert getattr(env, name) == 5.0


@pytest.mark.parametrize("kind", KINDS)
def test_every_other_argument_can_be_read_and_not_set(kind):
    env = kind(duration=3.0)
    for name, value in env.settings.arguments.items():
        assert getattr(env, name) == value
        if name not in WEIGHTS:
            with pytest.raises(AttributeError, match=f"^{name} of {kind.__name__} must be given when it is made, as"):
                setattr(env, name, value)
    with pytest.raises(AttributeError, match=r"only tracking_weight and energy_weight can be set$"):
        env.duration = 10.0
    assert env.settings.duration == 3.0


@pytest.mark.parametrize("make", [*KINDS, lambda **more: gym.make("elbow_gym:ElbowArm-v0", **more)])
def test_unknown_argument_is_a_type_error_with_those_that_there_are(make):
    with pytest.raises(
        TypeError, match=r"^arguments must be among \['action_unit', 'arm', .*\], got 'elbow'"
    ) as raised:
        make(elbow=2)
    assert "(perhaps 'elbows' is meant)" in str(raised.value)
    listed = str(raised.value).split("[")[1].split("]")[0]
    assert {f"'{name}'" for name in (*Settings().arguments, "render_mode", "render_width")} <= set(listed.split(", "))


@pytest.mark.parametrize(
    ("arguments", "horizon"),
    [({}, 250), ({"duration": 10.0}, 500), ({"control_frequency": 100.0}, 500), ({"max_episode_steps": 100}, 100)],
    ids=str,
)
def test_spec_says_after_how_many_control_periods_an_episode_is_truncated(arguments, horizon):
    for env in (
        gym.make("elbow_gym:ElbowArm-v0", **arguments),
        *(gym.make_vec("ElbowArm-v0", 2, autoreset_mode=mode, **arguments) for mode in AutoresetMode),
    ):
        assert env.spec.max_episode_steps == horizon
        assert lived(env) == (horizon, True)
    assert gym.spec("ElbowArm-v0").max_episode_steps is None


@pytest.mark.parametrize("mode", AutoresetMode)
def test_a_batch_is_cut_where_gymnasium_cuts_single_environments(mode):
    cut = {"num_envs": 3, "circle": {"phase": "random"}, "max_episode_steps": 4}
    ours = gym.make_vec("elbow_gym:ElbowArm-v0", autoreset_mode=mode, **cut)
    theirs = gym.make_vec("ElbowArm-v0", vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **cut)
    answers = []
    for env in (ours, theirs):
        played = [env.reset(seed=3)[0]]
        for k in range(11):
            played.append(env.step(action(env, k))[:4])
            if mode is AutoresetMode.DISABLED and played[-1][3].any():
                played.append(env.reset(options={"reset_mask": played[-1][3]})[0])
        answers.append(played)
    assert data_equivalence(answers[0], answers[1], exact=True)
    assert sum(len(answer) == 4 and answer[3].all() for answer in answers[0]) == 2


@pytest.mark.parametrize("value", [0, 2.5, True, -2, "long"])
def test_wrong_limit_is_refused_by_name(value):
    with pytest.raises(ValueError, match=f"^max_episode_steps must be a positive integer, got {value!r}$"):
        ElbowArmVectorEnv(2, max_episode_steps=value)


def test_a_longer_limit_than_the_duration_and_none_leave_the_duration():
    for limit in (1000, -1, None):
        env = gym.make_vec("elbow_gym:ElbowArm-v0", 2, duration=0.2, max_episode_steps=limit)
        assert (env.spec.max_episode_steps, lived(env)) == (10, (10, True))


def test_specs_travel_and_make_equal_environments():
    env = gym.make("elbow_gym:ElbowArm-v0", duration=0.2)
    batch = gym.make_vec("ElbowArm-v0", 2, duration=0.2, autoreset_mode="SameStep", max_episode_steps=7)
    for made, make in ((env, gym.make), (batch, gym.make_vec)):
        twins = [
            pickle.loads(pickle.dumps(made.spec)),
            copy.deepcopy(made.spec),
            EnvSpec.from_json(made.spec.to_json()),
        ]
        for twin in twins:
            again = make(twin)
            assert twin == made.spec
            assert again.spec == made.spec
            assert lived(again) == lived(made)
            assert data_equivalence(again.reset(seed=5), made.reset(seed=5), exact=True)
            longer = make(twin, duration=0.5, max_episode_steps=-1)
            assert (longer.spec.max_episode_steps, lived(longer)) == (25, (25, True))
    assert pickle.loads(pickle.dumps(env.unwrapped)).spec == env.unwrapped.spec


def test_time_of_a_time_aware_observation_ends_with_the_episode():
    env = TimeAwareObservation(gym.make("elbow_gym:ElbowArm-v0", duration=0.4), normalize_time=True)
    env.reset(seed=0)
    over = False
    while not over:
        observation, _, _, over, _ = env.step(action(env))
    assert observation[-1] == 1.0

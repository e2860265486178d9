"""Teacher of drawn tasks: its tasks are the environment's, and its motions those that the environment makes."""

import numpy as np
import pytest

from agents.learning.newton.teacher import Tasks, Teacher
from agents.learning.newton.training import played
from agents.tasks import task_settings
from elbow_gym import load_policy
from elbow_gym.interface import Interface
from elbow_gym.vector_env import ElbowArmVectorEnv

SETTINGS = task_settings("ElbowArmTasks-v0", 2, {"duration": 0.3})
SEEDS = [3, 4, 5]
SMOOTHING = 1e-4


@pytest.fixture(scope="module")
def env():
    return ElbowArmVectorEnv(len(SEEDS), **SETTINGS.arguments, autoreset_mode="Disabled")


def test_tasks_are_those_of_the_environment(env):
    observation, infos = env.reset(seed=SEEDS)
    tasks, interface = Tasks.of(env, observation), Interface(env)
    assert len(set(infos["parameters"]["payload"])) == len(SEEDS)
    for k in range(SETTINGS.horizon):
        observation, *_ = env.step(env.action_space.sample())
        observed = interface.decode(observation)
        target = observed["hand_position"] - observed["hand_error"] + infos["circle"]["center"]
        assert tasks.target[:, k] == pytest.approx(target, abs=1e-6)


def test_steps_save_cost_and_the_environment_makes_the_same_of_their_voltages(env):
    policy = load_policy("ppo", env="ElbowArmRandom-v0")
    observation, _ = env.reset(seed=SEEDS)
    tasks = Tasks.of(env, observation)
    size = policy.card.layers[0]
    _, motions, reward = played(env, observation, lambda k, observed, states: policy.predict(observed[:, :size])[0])
    teacher, price = Teacher(SETTINGS, len(SEEDS), above_table=False), np.full(len(SEEDS), 1.0)
    first = teacher.improve(tasks, motions, price, SMOOTHING)
    assert first.before == pytest.approx(-reward, rel=1e-3)
    second = teacher.improve(tasks, first.motions, first.price, SMOOTHING)
    assert second.before == pytest.approx(first.after, rel=1e-9)
    assert (second.after < 0.97 * first.before).all()
    observation, _ = env.reset(seed=SEEDS)
    better = second.motions
    _, again, reward = played(env, observation, lambda k, observed, states: better.voltage[:, k] / 24.0)
    assert -reward == pytest.approx(second.after, rel=1e-3)
    assert again.states == pytest.approx(better.states, abs=1e-3)


def test_joints_that_must_not_are_lifted_above_the_table(env):
    free = task_settings("ElbowArmTasks-v0", 0, {"duration": 0.3})
    arms = ElbowArmVectorEnv(len(SEEDS), **free.arguments, autoreset_mode="Disabled")
    observation, _ = arms.reset(seed=SEEDS)
    tasks = Tasks.of(arms, observation)
    # Without voltage the arm falls.
    _, motions, _ = played(arms, observation, lambda k, observed, states: np.zeros(arms.action_space.shape))
    depth, price = [], np.full(len(SEEDS), 1.0)
    teacher = Teacher(free, len(SEEDS), above_table=True)
    for _ in range(3):
        depth.append(-teacher._depth(motions.states[..., :10]).min())
        step = teacher.improve(tasks, motions, price, 0.1)
        motions, price = step.motions, step.price
    assert depth[0] > 0.01
    assert depth[-1] < 0.5 * depth[0]

"""Sampling control: plans depend on the observation and the seed alone, and get no worse."""

from dataclasses import replace

import numpy as np
import pytest

from agents.planning import sampling
from agents.planning.sampling import Plan, Sampling
from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv, paper_arm
from tests.support.rollouts import driven

FEW = {"horizon": 0.06, "samples": 16, "rounds": 1}


def test_plans_follow_from_the_seed():
    env = ElbowArmVectorEnv(1)
    first, again, other = (driven(env, Sampling(env, seed, **FEW), 3, 5) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.0


def test_an_arms_plan_is_the_same_alone_and_in_any_batch():
    batch, alone = ElbowArmVectorEnv(3, elbows=0), ElbowArmEnv(elbows=0)
    together = driven(batch, Sampling(batch, **FEW), 3, 7)
    for arm in (0, 2):
        np.testing.assert_array_equal(driven(alone, Sampling(alone, **FEW), 3, 7 + arm), together[:, arm])


def test_planning_leaves_the_environment_as_it_is():
    env = ElbowArmEnv()
    observation, _ = env.reset(seed=0)
    before, planner = env.get_state(), Sampling(env, **FEW)
    planner.predict(observation)
    np.testing.assert_equal(env.get_state(), before)


def test_an_arm_that_weighs_nothing_and_may_stay_where_it_is_gets_no_voltage():
    env = ElbowArmEnv(arm=replace(paper_arm(), gravity=0.0), tracking_weight=0.0)
    np.testing.assert_array_equal(driven(env, Sampling(env, **FEW), 3, 0), 0.0)


def test_a_load_that_policies_are_not_told_of_changes_no_plan():
    observation, _ = ElbowArmEnv().reset(seed=0)
    bare, loaded = (Sampling(ElbowArmEnv(payload=mass), **FEW) for mass in (0.0, 0.3))
    np.testing.assert_array_equal(bare.predict(observation)[0], loaded.predict(observation)[0])


def test_rounds_and_samples_make_no_plan_dearer():
    env = ElbowArmEnv(start="on_target")
    observation, _ = env.reset(seed=0)
    costs = {}
    for samples in (16, 64):
        planner = Sampling(env, **{**FEW, "samples": samples})
        view, rng = planner._views(observation[None])[0], np.random.default_rng(0)
        guesses, sides = planner._guesses(view), planner._sides(view)
        plan = Plan(np.zeros((planner.periods, 10)), np.full(2, sampling.SPREAD))
        found = []
        for _ in range(4):
            plan = planner._improved(plan, view, guesses, sides, rng)
            tried = np.repeat(plan.voltage[None], len(sampling.STRIDES) + 1, axis=0)
            found.append(planner._branches.costs(view, tried)[0])
        assert (np.diff(found) <= 0.0).all()
        costs[samples] = found[-1]
    assert costs[64] < costs[16]


def test_a_branch_costs_what_the_environment_charges():
    """Without the tail: zero duration of resting would be refused, so it is subtracted."""
    env = ElbowArmEnv(elbows=1)
    observation, _ = env.reset(seed=3)
    planner = Sampling(env, **FEW)
    view = planner._views(observation[None])[0]
    plan = np.random.default_rng(0).uniform(-5.0, 5.0, (planner.periods, 10))
    plans = np.repeat(plan[None], len(sampling.STRIDES) + 1, axis=0)
    found = planner._branches.costs(view, plans)
    rewards = [env.step(planner.interface.action(voltage))[1] for voltage in plan]
    simulator = env.episodes.simulator
    tail = planner.tail.cost(simulator.q[0], simulator.q_dot[0], view.target[2], view.velocity[2], 1.0, 0.001)
    np.testing.assert_allclose(found, tail - sum(rewards), rtol=1e-6)


def test_too_few_samples_for_the_approaches_are_refused():
    with pytest.raises(ValueError, match="samples must be at least 9, got 8"):
        Sampling(ElbowArmEnv(), samples=8)

"""Receding-horizon control: the bound's program from any state, solved anew, with a fall-back."""

from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.metrics import metrics
from agents.evaluation.recording import record
from agents.planning import receding_horizon
from agents.planning.receding_horizon import RecedingHorizon
from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv, paper_arm
from elbow_gym.task.settings import Settings
from tests.support.rollouts import driven

pytest.importorskip("casadi")
SHORT = {"horizon": 0.06}


def test_an_arms_plan_is_the_same_alone_and_in_any_batch_and_whenever_it_is_made():
    batch, alone = ElbowArmVectorEnv(2, start="on_target"), ElbowArmEnv(start="on_target")
    together = driven(batch, RecedingHorizon(batch, **SHORT), 2, 7)
    np.testing.assert_array_equal(together, driven(batch, RecedingHorizon(batch, **SHORT), 2, 7))
    np.testing.assert_array_equal(driven(alone, RecedingHorizon(alone, **SHORT), 2, 8), together[:, 1])


def test_planning_leaves_the_environment_as_it_is():
    env = ElbowArmEnv(start="on_target")
    observation, _ = env.reset(seed=0)
    before = env.get_state()
    RecedingHorizon(env, **SHORT).predict(observation)
    np.testing.assert_equal(env.get_state(), before)


def test_an_arm_that_weighs_nothing_and_may_stay_where_it_is_gets_no_voltage():
    env = ElbowArmEnv(arm=replace(paper_arm(), gravity=0.0), tracking_weight=0.0)
    assert np.abs(driven(env, RecedingHorizon(env, **SHORT), 2, 0)).max() < 1e-6


def test_plan_is_what_the_simulator_does():
    env = ElbowArmEnv(start="on_target")
    observation, _ = env.reset(seed=0)
    planner = RecedingHorizon(env, **SHORT)
    planner.predict(observation)
    parts, voltage = planner._program.split(planner._plans[0].x)
    start = env.episodes.simulator.q[0].copy()
    for k in range(planner.periods):
        env.step(planner.interface.action(voltage[k]))
        # Two Radau points resolve the first milliseconds after a voltage's jump to some hundredths of the motion.
        moved = np.abs(parts["q"][k, -1] - start).max()
        np.testing.assert_allclose(env.episodes.simulator.q[0], parts["q"][k, -1], rtol=0.0, atol=0.05 * moved)


def test_where_the_solver_fails_the_shifted_plan_is_carried_out_and_counted(monkeypatch):
    env = ElbowArmEnv(start="on_target")
    planner = RecedingHorizon(env, **SHORT)
    observation, _ = env.reset(seed=0)
    planner.predict(observation)
    planned = planner._program.split(planner._plans[0].x)[1]
    solve = planner._program.solve

    def failing(*arguments, **options):
        x, multipliers, stats = solve(*arguments, **options)
        return 0.0 * x, multipliers, {**stats, "return_status": "Maximum_Iterations_Exceeded"}

    monkeypatch.setattr(planner._program, "solve", failing)
    for k in (1, 2, 2):
        np.testing.assert_array_equal(planner.predict(observation)[0], planner.interface.action(planned[k]))
    assert planner.failures == 3
    # Then it starts anew, from rest, as it did at first.
    monkeypatch.setattr(planner._program, "solve", solve)
    np.testing.assert_array_equal(
        planner.predict(observation)[0], RecedingHorizon(env, **SHORT).predict(observation)[0]
    )
    assert planner.failures == 3


def test_where_the_first_solve_fails_the_arm_is_held(monkeypatch):
    env = ElbowArmEnv(start="on_target")
    monkeypatch.setattr(receding_horizon, "FIRST_ITERATIONS", 0)
    planner = RecedingHorizon(env, **SHORT)
    observation, _ = env.reset(seed=0)
    hold = planner.inverse.resistance * planner.inverse.hold(env.episodes.simulator.q[0]).current
    np.testing.assert_allclose(planner.predict(observation)[0], planner.interface.action(hold), rtol=0.0, atol=1e-5)
    assert planner.failures == 1


def test_a_load_that_policies_are_not_told_of_changes_no_plan():
    observation, _ = ElbowArmEnv(start="on_target").reset(seed=0)
    bare, loaded = (RecedingHorizon(ElbowArmEnv(start="on_target", payload=mass), **SHORT) for mass in (0.0, 0.3))
    np.testing.assert_array_equal(bare.predict(observation)[0], loaded.predict(observation)[0])


def test_what_the_program_does_not_know_is_refused_by_name():
    with pytest.raises(ValueError, match="regeneration must be True in the collocation program, got False"):
        RecedingHorizon(ElbowArmEnv(regeneration=False))


def test_casadi_is_asked_for_by_name(monkeypatch):
    monkeypatch.setattr(receding_horizon, "find_spec", lambda _: None)
    with pytest.raises(ValueError, match=r"casadi must be installed .*elbow-gym\[optimal\]"):
        RecedingHorizon(ElbowArmEnv())


@pytest.mark.slow
def test_looking_farther_ahead_costs_no_more():
    settings = Settings(start="on_target", duration=0.3, start_noise=0.0)
    found = [
        metrics(record(settings, lambda env, far=far: RecedingHorizon(env, horizon=far), [0]))["return"][0]
        for far in (0.04, 0.2)
    ]
    assert found[1] > found[0]

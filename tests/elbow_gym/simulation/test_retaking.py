"""Control periods taken again: arms that start with more energy than a run comes to keep account of every joule."""

from dataclasses import replace

import numpy as np
import pytest

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv, MotorParameters, paper_arm
from elbow_gym.simulation import retaking

RNG = np.random.default_rng(0)
POSE, RATES = RNG.normal(size=10), 20.0 * RNG.normal(size=10)
"""Of an arm with 2.1 kJ, where full voltages bring it to 0.15 kJ at most."""
ACTIONS = RNG.choice([-1.0, 1.0], (30, 10))
STATE = {"q": POSE, "q_dot": RATES}


def whirling(state=STATE, env=None):
    env = ElbowArmEnv(elbows=0) if env is None else env
    env.reset(seed=0, options={"state": state})
    return env, env.episodes.simulator


def missing(sim, before):
    lost = sim.copper_loss.sum() + sim.friction_loss.sum()
    return abs(sim.electrical_energy.sum() - lost - sim.stored_energy[0] + before) / (sim.drawn_energy.sum() + lost)


@pytest.mark.parametrize("watched", [True, False])
def test_an_arm_that_starts_with_much_energy_loses_none_unseen(watched):
    env, sim = whirling()
    before = sim.stored_energy[0]
    if not watched:
        # The same state saved as that of an arm which came to it from rest.
        sim.set_state({**sim.get_state(), "motion": np.zeros(1)})
    ended = [env.step(action)[2] for action in ACTIONS]
    assert (missing(sim, before) < 1e-3) == watched
    assert any(ended) == (not watched)


def test_such_an_arm_moves_alike_in_a_batch_and_goes_on_from_a_saved_state():
    env, _ = whirling()
    batch = ElbowArmVectorEnv(3, elbows=0, autoreset_mode="Disabled")
    batch.reset(seed=[4, 0, 5])
    batch.reset(seed=[4, 0, 5], options={"state": STATE, "reset_mask": np.array([False, True, False])})
    twin = ElbowArmEnv(elbows=0)
    for k, action in enumerate(ACTIONS[:12]):
        if k == 6:
            twin.set_state(env.get_state())
        observation, reward, _, _, info = env.step(action)
        together = batch.step(np.stack([0.0 * action, action, 0.0 * action]))
        np.testing.assert_array_equal(observation, together[0][1])
        assert (reward, info["electrical_energy"]) == (together[1][1], together[4]["electrical_energy"][1])
        if k >= 6:
            np.testing.assert_array_equal(observation, twin.step(action)[0])


def test_rewards_of_such_an_arm_pay_each_joule_once():
    env, sim = whirling()
    paid = sum(env.step(action)[4]["electrical_power"] for action in ACTIONS) / 50.0
    assert paid == pytest.approx(sim.electrical_energy.sum(), rel=1e-9)


def test_balance_is_checked_until_the_energy_of_the_start_is_gone_and_never_of_an_arm_at_rest():
    env, sim = whirling({"q": POSE, "q_dot": RATES / 50.0})
    first = sim.get_state()["motion"][0]
    assert 0.0 < first == pytest.approx(sim.stored_energy[0] - whirling({"q": POSE})[1].stored_energy[0])
    for action in ACTIONS[:10]:
        env.step(action)
    assert sim.get_state()["motion"][0] == 0.0
    assert whirling({"q": POSE})[1].get_state()["motion"][0] == 0.0


def test_an_arm_that_no_steps_bring_through_stays_where_it_was_and_its_episode_ends(monkeypatch):
    monkeypatch.setattr(retaking, "FINER", ())
    env, sim = whirling()
    for action in ACTIONS:
        before = sim.q.copy()
        terminated = env.step(action)[2]
        if terminated:
            break
    assert terminated
    np.testing.assert_array_equal(sim.q, before)


@pytest.mark.parametrize(("inductance", "always"), [(0.02, False), (0.03, True)])
def test_balance_is_always_checked_where_currents_last(inductance, always):
    arm = replace(paper_arm(), motors=(MotorParameters(armature_inductance=inductance),) * 10)
    env = ElbowArmEnv(elbows=0, arm=arm)
    env.reset(seed=0)
    for action in ACTIONS[:3]:
        env.step(action)
    # R / L is 55 and 37 1/s.
    assert (env.episodes.simulator.get_state()["motion"][0] > 0.0) == always


def test_the_papers_arm_costs_no_balance_at_the_rate_of_its_pd():
    # A control period is a third of the currents' time constant there, which tells nothing of the links.
    env = ElbowArmEnv(elbows=2, control_frequency=2000.0)
    env.reset(seed=0)
    assert not env.episodes.simulator.get_state()["motion"].any()

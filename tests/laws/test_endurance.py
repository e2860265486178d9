"""All switches at once: a million steps stay finite, and lanes, batch sizes and threads change no bit."""

from dataclasses import replace

import numpy as np
import pytest

from elbow_gym import (
    Conditions,
    ElbowArmEnv,
    ElbowArmVectorEnv,
    MotorParameters,
    Simulator,
    kinematics,
    paper_arm,
)

EVERYTHING = Conditions(
    table={"friction": 0.4},
    elbow_friction=0.3,
    heat=True,
    supply_resistance=0.1,
    regeneration=False,
    payload=0.2,
)


def rough_arm():
    return replace(paper_arm(), motors=(MotorParameters(gear_coulomb_friction=0.02),) * 10)


def arms(num_envs, num_threads=1):
    return Simulator(rough_arm(), 2, num_envs, conditions=EVERYTHING, timestep=4e-4, num_threads=num_threads)


def poses(sim, num_envs):
    noise = np.random.default_rng(5).normal(size=(70, 10))[:num_envs]
    return sim.on_table(sim.arm.nominal_pose + 0.05 * noise)


def rollout(num_envs, first=0, num_threads=1):
    """State, forces and meters after a tenth of a second of the arms from `first` on."""
    sim = arms(num_envs, num_threads)
    whole = arms(70)
    rows = slice(first, first + num_envs)
    sim.reset(poses(whole, 70)[rows], temperature_rise=np.full(10, 20.0))
    rng = np.random.default_rng(6)
    for _ in range(10):
        sim.step(rng.uniform(-24.0, 24.0, (70, 10))[rows], 25)
    assert sim.valid.all()
    return {**sim.get_state(), "contact_force": sim.contact_force, "elbow_force": sim.elbow_force.copy()}


@pytest.fixture(scope="module")
def seventy():
    found = rollout(70)
    assert found["contact_force"].any()
    return found


@pytest.mark.parametrize("num_threads", [2, 3, 8])
def test_threads_change_no_bit(seventy, num_threads):
    for name, value in rollout(70, num_threads=num_threads).items():
        np.testing.assert_array_equal(value, seventy[name], err_msg=name)


@pytest.mark.parametrize(("num_envs", "first"), [(1, 0), (1, 69), (2, 15), (3, 64), (17, 20)])
def test_neither_batch_size_nor_lane_changes_a_bit(seventy, num_envs, first):
    for name, value in rollout(num_envs, first).items():
        np.testing.assert_array_equal(value, seventy[name][first : first + num_envs], err_msg=name)


def test_an_arm_that_overflows_is_flagged_and_leaves_the_others_alone(seventy):
    sim = arms(3)
    q = poses(arms(70), 70)[:3]
    sim.reset(q, current=[[0.0] * 10, [1e200] * 10, [0.0] * 10], temperature_rise=np.full(10, 20.0))
    rng = np.random.default_rng(6)
    for _ in range(10):
        sim.step(rng.uniform(-24.0, 24.0, (70, 10))[:3], 25)
    np.testing.assert_array_equal(sim.valid, [True, False, True])
    np.testing.assert_array_equal(sim.get_state()["state"][[0, 2]], seventy["state"][[0, 2]])
    assert np.isfinite(sim.get_state()["state"]).all()


def lever(sim, arm):
    """How far elbows 4 and 7 can be moved off the table by turning their links [m/rad], whichever is less."""
    slope = np.abs(sim.arm.of_links("length") * np.sin(kinematics.pitches(sim.q[arm])))
    return min(slope[1:3].max(), slope[3:6].max())


@pytest.mark.slow
def test_a_million_random_and_bang_bang_steps_stay_finite():
    sim = arms(256)
    rng, flagged, pressed = np.random.default_rng(7), 0, 0.0
    for k in range(200):
        bang = 24.0 * rng.choice([-1.0, 1.0], (256, 10))
        sim.step(bang if k % 2 else rng.uniform(-24.0, 24.0, (256, 10)), 50)
        state = sim.get_state()
        for values in (state["state"], state["summary"], sim.contact_force):
            assert np.isfinite(values).all()
        assert (sim.contact_force[..., 2] >= 0.0).all()
        pressed += sim.contact_force[..., 2].sum()
        # No finite force holds an elbow whose links all stand upright, and its friction jams the arm.
        for arm in np.flatnonzero(~sim.valid):
            assert lever(sim, arm) < 0.1
            flagged += 1
        sim.reset(mask=~sim.valid)
    assert flagged < 10
    assert pressed > 0.0
    assert (sim.temperature_rise >= 0.0).all()


def test_elbows_that_for_an_instant_can_hardly_move_against_each_other_end_no_episode():
    # Found among 1,536 episodes of full voltages that turn their sign now and then: in the 214th period of this one the
    # elbows push with 7.6 kN, and whole steps lead to what float64 cannot represent.
    rng, held, played = np.random.default_rng(0), np.ones((512, 10)), []
    for k in range(249):
        flip = rng.random((512, 10)) < 0.05
        held = rng.choice([-1.0, 1.0], (512, 10)) if k == 0 else held
        held = np.where(flip, -held, held)
        played.append(held[210])
    alone, batch = ElbowArmEnv(elbows=2), ElbowArmVectorEnv(3, elbows=2)
    alone.reset(seed=210)
    batch.reset(seed=[1, 210, 2])
    for action in played:
        observation, reward, terminated, _, info = alone.step(action)
        together = batch.step(np.stack([0.0 * action, action, 0.0 * action]))
        np.testing.assert_array_equal(observation, together[0][1])
        assert (reward, terminated) == (together[1][1], False)
    # Steps of 0.05 ms come to 20,717 J.
    assert info["electrical_energy"] == pytest.approx(20_717.0, rel=0.02)

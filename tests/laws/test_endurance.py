"""All switches at once, and all ids: millions of steps stay finite, and lanes, batches and threads change no bit."""

from dataclasses import replace

import gymnasium as gym
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
    for k in range(80):
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


EVERY_SWITCH = {
    "elbow_friction": 0.1, "table": {"friction": 0.3}, "heat": True, "supply_resistance": 0.1, "regeneration": False,
    "gear_coulomb_friction": 0.005, "payload": 0.2,
}  # fmt: skip
ENDURED = {
    "two elbows": ("ElbowArm-v0", {}),
    "one elbow": ("ElbowArm-v0", {"elbows": 1}),
    "no elbow": ("ElbowArm-v0", {"elbows": 0}),
    "table": ("ElbowArmTable-v0", {}),
    "random arms and circles": ("ElbowArmRandom-v0", {}),
    "tasks": ("ElbowArmTasks-v0", {}),
    "several objectives": ("mo-ElbowArm-v0", {}),
    "rubbing elbows": ("ElbowArm-v0", {"elbow_friction": 0.1}),
    "heat, supply and rough gears": (
        "ElbowArm-v0", {name: EVERY_SWITCH[name] for name in ("heat", "supply_resistance", "gear_coulomb_friction")}
    ),
    "every switch": ("ElbowArm-v0", EVERY_SWITCH),
    "every switch by the classical method": ("ElbowArm-v0", {**EVERY_SWITCH, "integrator": "rk4"}),
}  # fmt: skip
"""Ids and arguments of a million steps each."""


def endured(name, rounds):
    """Figures of `rounds` times 64,000 control periods: uniform, bang-bang and seldom changing voltages in turns.

    That is control periods, episodes that ended early or whose infos said that they are not to be trusted, the worst
    energy balance of the others, and whether every number was finite.
    """
    identity, arguments = ENDURED[name]
    env = gym.make_vec(identity, num_envs=256, autoreset_mode="Disabled", **arguments)
    sim, rng = env.unwrapped.episodes.simulator, np.random.default_rng(11)
    periods, ended, told, worst, finite = 0, 0, 0, 0.0, True
    for k in range(rounds):
        env.reset(seed=1000 * k)
        before, held = sim.stored_energy, rng.choice([-1.0, 1.0], (256, 10))
        over, astray = np.zeros(256, dtype=bool), np.zeros(256, dtype=bool)
        for _ in range(env.unwrapped.settings.horizon):
            held = np.where(rng.random((256, 10)) < (0.5, 0.05)[k % 2], -held, held)
            action = rng.uniform(-1.0, 1.0, (256, 10)) if k % 3 == 2 else held
            observation, reward, terminated, _, info = env.step(action.astype(np.float32))
            finite &= bool(np.isfinite(observation).all() and np.isfinite(reward).all())
            over |= terminated
            astray |= info["constraint_residual"] > 1e-6
            periods += 256
            if terminated.any():
                env.reset(options={"reset_mask": terminated})
        finite &= bool(np.isfinite(sim.get_state()["state"]).all())
        lost = sim.copper_loss.sum(1) + sim.friction_loss.sum(1) + sim.contact_loss.sum(1)
        missing = np.abs(info["electrical_energy"] - lost - sim.stored_energy + before)
        ended, told = ended + over.sum(), told + (astray & ~over).sum()
        worst = max(worst, (missing / (info["drawn_energy"] + lost))[~(over | astray)].max())
    return {"periods": periods, "ended": int(ended), "told": int(told), "worst": float(worst), "finite": finite}


@pytest.mark.soak
@pytest.mark.parametrize("name", ENDURED)
def test_a_million_control_periods_of_every_id_and_switch_stay_finite_and_balanced(name):
    found = endured(name, 16)
    assert found["periods"] > 1_000_000
    assert found["finite"]
    # One of 4,096 arms whose links were drawn comes to 1.2e-3, where links between its elbows all but stretch out.
    assert found["worst"] < (2e-3 if name == "random arms and circles" else 1e-3)
    assert found["ended"] < 10
    # Full voltages for five seconds jam most arms that rub once, in a hundredth of their control periods.
    assert found["told"] < 60 or "elbow_friction" in ENDURED[name][1]

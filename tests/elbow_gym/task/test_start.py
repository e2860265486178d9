"""Start states: no joint starts under a compliant table, and given states that no run can follow are refused."""

import numpy as np
import pytest

from elbow_gym import Conditions, ElbowArmEnv, ElbowArmVectorEnv, Simulator, contact, kinematics, paper_arm
from elbow_gym.simulator import PLANE_TOLERANCE
from elbow_gym.task.start import above_table

TABLE = {"elbows": 0, "table": True}


def heights(arm, q):
    """Of joints 3..n and the hand [m], (B, n - 1)."""
    return kinematics.joint_positions(arm, q)[..., 2:, 2]


@pytest.mark.parametrize("start", ["paper", "on_target"])
def test_no_arm_starts_with_energy_in_the_tables_spring(start):
    env = ElbowArmVectorEnv(64, **TABLE, start=start)
    env.reset(seed=0)
    sim = env.episodes.simulator
    assert heights(sim.arm, sim.q).min() >= -PLANE_TOLERANCE
    elastic = [contact.contact_energy(sim.arm, sim.conditions.surface, q).sum() for q in sim.q]
    assert max(elastic) < 1e-10
    # Without a table, joints 4 and 7 start as often below z = 0 as above.
    free = ElbowArmVectorEnv(64, elbows=0, start=start)
    free.reset(seed=0)
    assert heights(sim.arm, free.episodes.simulator.q).min() < -0.03


def test_poses_above_the_table_start_as_they_do_without_one():
    held, free = (ElbowArmVectorEnv(32, elbows=0, table=table) for table in (True, False))
    (_, held_info), (_, free_info) = held.reset(seed=3), free.reset(seed=3)
    ours, theirs = held.episodes.simulator.q, free.episodes.simulator.q
    above = heights(paper_arm(), theirs).min(axis=1) >= 0.0
    assert 4 < above.sum() < 28
    np.testing.assert_array_equal(ours[above], theirs[above])
    assert (ours[~above] != theirs[~above]).any(axis=1).all()
    assert held_info["tracking_error"][above] == pytest.approx(free_info["tracking_error"][above])


def test_a_low_link_is_turned_until_its_end_lies_on_the_table_and_the_others_keep_their_pitch():
    sim = Simulator("paper", 0, conditions=Conditions(table=True), timestep=5e-4)
    q = np.array(paper_arm().nominal_pose)
    # Link 3 comes down to joint 4, which is at z = 0: steeper, it ends below.
    q[2] += 0.1
    raised = above_table(sim, q[None])[0]
    assert heights(sim.arm, q)[1] < -0.02
    assert heights(sim.arm, raised)[1] == pytest.approx(0.0, abs=1e-12)
    before, after = kinematics.pitches(q), kinematics.pitches(raised)
    assert after[2] < before[2]
    kept = heights(sim.arm, q) - heights(sim.arm, q)[1] >= -1e-12
    assert kept[2:].any()
    np.testing.assert_allclose(np.delete(after, 2)[:3], np.delete(before, 2)[:3], rtol=0.0, atol=1e-12)


def test_windings_of_an_angle_are_kept():
    sim = Simulator("paper", 0, conditions=Conditions(table=True), timestep=5e-4)
    q = np.array(paper_arm().nominal_pose)
    q[2] += 0.1
    wound = q.copy()
    wound[1] += 4.0 * np.pi
    np.testing.assert_allclose(above_table(sim, wound[None]) - above_table(sim, q[None]), wound[None] - q, atol=1e-12)


def test_rigid_elbows_stay_at_zero_while_joints_between_them_are_raised():
    sim = Simulator("paper", (4, 7), 8, conditions=Conditions(table=True), timestep=5e-4)
    q = sim.on_table(paper_arm().nominal_pose + 0.1 * np.random.default_rng(0).normal(size=(8, 10)))
    assert heights(sim.arm, q).min() < -0.01
    raised = above_table(sim, q)
    assert heights(sim.arm, raised).min() >= -PLANE_TOLERANCE
    np.testing.assert_allclose(heights(sim.arm, raised)[:, [1, 4]], 0.0, atol=PLANE_TOLERANCE)


def test_a_given_pose_deeper_than_weight_presses_is_refused_by_name():
    env = ElbowArmEnv(**TABLE, start_noise=0.0)
    env.reset(seed=0)
    flat = np.pi / 2.0 * np.eye(10)[1]
    # All ten links weigh 9.81 N; nine times that on one point sinks in by 4.4 mm.
    env.reset(options={"state": {"q": flat + np.eye(10)[9] * np.arcsin(0.0043 / 0.3)}})
    with pytest.raises(
        ValueError,
        match=r"^options\['state'\] q must have joint 11 at most 0\.00441 m deep in the table "
        r"\(joint 11 is the hand\), got 0\.0045 m$",
    ):
        env.reset(options={"state": {"q": flat + np.eye(10)[9] * np.arcsin(0.0045 / 0.3)}})
    deep = ElbowArmEnv(elbows=0, start_noise=0.0)
    deep.reset(seed=0, options={"state": {"q": flat + np.eye(10)[9]}})


@pytest.mark.parametrize(
    ("state", "rate"),
    [({"q_dot": 1e3}, "speed"), ({"current": 1e4}, "speed"), ({"q_dot": [0.0] * 9 + [600.0]}, "whirl")],
)
def test_a_given_state_too_fast_for_the_steps_is_refused_by_the_rates_name(state, rate):
    env = ElbowArmEnv(start_noise=0.0, elbows=0)
    env.reset(seed=0)
    before = env.get_state()["episodes"]["simulator"]["state"]
    q = env.episodes.pose
    with pytest.raises(
        ValueError, match=rf"^options\['state'\] must allow substeps of 0\.0055 s, .* the rate '{rate}' "
    ):
        env.reset(options={"state": {"q": q, **{name: np.broadcast_to(x, 10) for name, x in state.items()}}})
    np.testing.assert_array_equal(env.get_state()["episodes"]["simulator"]["state"], before)


def test_what_a_run_comes_to_may_be_given_as_a_start():
    env = ElbowArmEnv(**TABLE)
    rng = np.random.default_rng(1)
    env.reset(seed=0)
    for _ in range(50):
        env.step(rng.choice([-1.0, 1.0], 10).astype(np.float32))
        sim = env.episodes.simulator
        other = ElbowArmEnv(elbows=0)
        other.reset(seed=0, options={"state": {"q": sim.q[0], "q_dot": sim.q_dot[0], "current": sim.current[0]}})

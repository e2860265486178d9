"""Drawn tasks: in their box, set again by options to the last bit, the same in a batch, fifty kept for evaluation."""

import functools
import json

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

import elbow_gym
from agents.evaluation.regimes import BENCHMARK_SEEDS
from agents.learning.train import SEED_STRIDE
from elbow_gym import Circle, ElbowArmEnv, evaluation_tasks, reset_options
from elbow_gym.kinematics import elbow_heights, joint_positions
from elbow_gym.suite import ENV, EVALUATION_SEEDS
from elbow_gym.task.infos import of_arm, unmasked

HORIZON = 8
make = functools.partial(gym.make, ENV, duration=0.02 * HORIZON)
same = functools.partial(data_equivalence, exact=True)
each_count = pytest.mark.parametrize("elbows", [2, 1, 0])


def actions(num_envs, steps):
    return np.random.default_rng(1).uniform(-1.0, 1.0, (steps, num_envs, 10)).astype(np.float32)


def played(env, **reset):
    """Observations, rewards and the last info of an episode."""
    observation, info = env.reset(**reset)
    seen, rewards = [observation], []
    for action in actions(1, HORIZON)[:, 0]:
        observation, reward, _, truncated, info = env.step(action)
        seen.append(observation)
        rewards.append(reward)
    assert truncated
    return np.array(seen), rewards, info


@each_count
def test_an_info_and_the_evaluation_tasks_set_a_task_again_bit_for_bit(elbows):
    env, k = make(elbows=elbows), 7
    drawn = played(env, seed=EVALUATION_SEEDS[k])
    for options in (reset_options(drawn[2]), evaluation_tasks(elbows)[k]):
        again = played(make(elbows=elbows), seed=3, options=json.loads(json.dumps(options)))
        assert same(again[:2], drawn[:2])
        for name in ("circle", "start"):
            assert same(dict(again[2][name]), dict(drawn[2][name]))
    assert evaluation_tasks(elbows, np.array([5, EVALUATION_SEEDS[k]]))[1] == evaluation_tasks(elbows)[k]
    assert not same(played(env, seed=3)[0], drawn[0])


@each_count
def test_evaluation_tasks_differ_lie_in_the_box_and_start_above_the_table(elbows):
    tasks, env = evaluation_tasks(elbows), make(elbows=elbows)
    assert len({json.dumps(task) for task in tasks}) == len(tasks) == 50
    assert tasks == evaluation_tasks(elbows)
    box, arm, joints = elbow_gym.TASKS["circle"], env.unwrapped.episodes.arm, env.unwrapped.settings.elbow_joints
    pose = env.unwrapped.episodes.pose
    for task in tasks:
        circle = task["circle"]
        for value, (low, high) in zip(circle["center"], box["center"], strict=True):
            assert low <= value <= high
        assert all(box[name][0] <= circle[name] <= box[name][1] for name in ("radius", "period", "tilt"))
        assert 0.0 <= task["parameters"]["payload"] <= (0.3 if elbows else 0.05)
        q = np.array(task["state"]["q"])
        assert np.abs(q - pose).max() <= 0.3 + 1e-8
        assert joint_positions(arm, q)[2:, 2].min() >= -1e-8
        assert np.abs(elbow_heights(arm, q, joints)).max(initial=0.0) <= 1e-8
    assert {task["circle"]["direction"] for task in tasks} == {"clockwise", "counterclockwise"}


def test_no_training_draws_from_the_seeds_of_the_evaluation_tasks():
    # Stable-Baselines3 hands a training's seed to NumPy; a training's arm i has seed * SEED_STRIDE + i.
    with pytest.raises(ValueError, match="between 0 and"):
        np.random.seed(EVALUATION_SEEDS[0])  # noqa: NPY002
    assert EVALUATION_SEEDS[0] % SEED_STRIDE > 100_000
    assert not {*EVALUATION_SEEDS} & {*BENCHMARK_SEEDS}


@each_count
def test_tasks_of_a_batch_are_those_of_single_environments_across_an_autoreset(elbows):
    singles = [make(elbows=elbows) for _ in range(3)]
    batch = gym.make_vec(ENV, num_envs=3, elbows=elbows, duration=0.02 * HORIZON)
    rows = [(*env.reset(seed=9 + i), 0.0, False) for i, env in enumerate(singles)]
    seen, infos = batch.reset(seed=9)
    for action in (*actions(3, HORIZON + 2), None):
        for i, (observation, info, _, _) in enumerate(rows):
            np.testing.assert_array_equal(seen[i], observation)
            one = of_arm(unmasked(infos), i)
            for name in ("circle", "parameters", "start"):
                assert same(dict(one[name]), dict(info[name]))
        if action is None:
            break
        for i, env in enumerate(singles):
            if rows[i][3]:
                rows[i] = (*env.reset(), 0.0, False)
            else:
                observation, reward, _, truncated, info = env.step(action[i])
                rows[i] = (observation, info, reward, truncated)
        seen, rewards, _, _, infos = batch.step(action)
        assert rewards.tolist() == [row[2] for row in rows]


def test_the_observation_says_what_the_task_is():
    env = make()
    seen, info = env.reset(seed=5)
    task = Circle(**reset_options(info)["circle"])
    for count in range(HORIZON + 1):
        found = env.unwrapped.decode(seen)
        hand = joint_positions(env.unwrapped.episodes.arm, env.unwrapped.episodes.simulator.q[0])[-1]
        time = 0.02 * count
        later = [hand - task.position(task.angle(time + ahead, task.phase)) for ahead in (0.3, 0.6, 1.2)]
        expected = {
            "further_error": np.concatenate(later),
            "target_velocity": task.velocity(task.angle(time, task.phase)),
            "circle_radius": [task.radius],
            "angular_velocity": [task.rate],
            "plane_normal": task.normal,
            "payload": [info["parameters"]["payload"]],
            "time_left": [1.0 - count / HORIZON],
        }
        for name, value in expected.items():
            np.testing.assert_allclose(found[name], value, rtol=2e-7, atol=2e-7, err_msg=name)
        if count < HORIZON:
            seen, *_, info = env.step(actions(1, HORIZON)[count, 0])
    assert list(found)[-7:] == list(expected)


def test_what_a_reset_or_a_saved_state_changes_is_observed():
    env, other = make(), make()
    env.reset(seed=1)
    seen, _ = env.reset(options={"circle": {"radius": 0.07, "tilt": 0.0}, "parameters": {"payload": 0.25}})
    found = env.unwrapped.decode(seen)
    for name, value in (("circle_radius", [0.07]), ("plane_normal", [0.0, 0.0, 1.0]), ("payload", [0.25])):
        np.testing.assert_allclose(found[name], value, rtol=1e-6, atol=1e-12)
    other.reset(seed=2)
    other.unwrapped.set_state(env.unwrapped.get_state())
    ours, theirs = (one.step(np.zeros(10, np.float32)) for one in (env, other))
    assert same(ours[0], theirs[0])
    assert same(dict(ours[4]["start"]), dict(theirs[4]["start"]))


def test_layout_keeps_the_entries_that_are_always_there_and_appends_the_tasks():
    plain, told = (ElbowArmEnv(randomize={"action_delay": [0, 1]}, task_observation=told) for told in (False, True))
    assert told.observation_names[: len(plain.observation_names)] == plain.observation_names
    assert told.observation_names[len(plain.observation_names) :] == (
        *(f"further_error_{t}s_{axis} [m]" for t in (0.3, 0.6, 1.2) for axis in "xyz"),
        *(f"target_velocity_{axis} [m/s]" for axis in "xyz"),
        "circle_radius [m]",
        "angular_velocity [rad/s]",
        *(f"plane_normal_{axis} [-]" for axis in "xyz"),
        "payload [kg]",
        "time_left [-]",
    )
    ours, theirs = (env.reset(seed=0)[0] for env in (told, plain))
    np.testing.assert_array_equal(ours[: theirs.size], theirs)
    assert (np.abs(ours) <= told.observation_space.high).all()


def test_sensors_noise_is_on_all_that_is_measured_of_the_hand():
    noisy, quiet = (
        ElbowArmEnv(task_observation=True, randomize={"sensor_noise": level}).reset(seed=0)[0] for level in (0.01, 0.0)
    )
    found = ElbowArmEnv(task_observation=True).decode(noisy != quiet)
    assert {name for name, entries in found.items() if entries.all()} == {
        *("joint_angle", "joint_velocity", "current", "hand_error", "hand_position", "lookahead_error", "further_error")
    }
    assert {name for name, entries in found.items() if entries.any()} == {
        name for name, entries in found.items() if entries.all()
    }


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"task_observation": 1}, "task_observation must be True or False, got 1"),
        ({"randomize": "task"}, "randomize must be a dict of ranges, \"tasks\" or None, got 'task'"),
        ({"start_spread": -0.1}, r"start_spread must not be negative, got -0\.1"),
        (
            {"task_observation": True, "circle": {"shape": [(1.4, 1.4, 0.3), (1.6, 1.4, 0.4), (1.5, 1.6, 0.4)]}},
            "circle shape must have a plane where the task is observed, got 3 points",
        ),
        ({"circle": {"tilt": 1.6}}, r"circle tilt must be at most a right angle \(1\.5708 rad\) either way, got 1\.6"),
        ({"circle": {"tilt_axis": "any"}}, "circle tilt_axis must be an angle in rad or \"random\", got 'any'"),
    ],
)
def test_a_wrong_argument_is_named(arguments, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        ElbowArmEnv(**arguments)


def test_a_pose_that_cannot_be_spread_above_the_table_is_refused_with_the_reset():
    low = [0.0, 2.0, *[0.0] * 8]
    arm = {**elbow_gym.paper_arm().to_dict(), "nominal_pose": low}
    env = ElbowArmEnv(arm=arm, elbows=0, start_spread=0.01, circle={"center": [1.0, 1.0, 0.4]})
    with pytest.raises(ValueError, match=r"^start_spread must allow poses above the table, got none in 1000 draws abo"):
        env.reset(seed=0)


@pytest.mark.parametrize("elbows", [3, True, (4,)])
def test_evaluation_tasks_are_those_of_the_papers_elbow_counts(elbows):
    with pytest.raises(ValueError, match=r"^elbows must be 0, 1 or 2, got "):
        evaluation_tasks(elbows)


@pytest.mark.parametrize("seeds", [[], [-1], [0.5]])
def test_tasks_of_other_seeds_need_some_and_valid_ones(seeds):
    with pytest.raises(ValueError, match=r"^seeds must be integers of at least 0, one or more, got "):
        evaluation_tasks(2, seeds)


@each_count
def test_starts_on_the_target_have_the_hand_there_and_no_joint_below_the_table(elbows):
    arms = gym.make_vec(ENV, num_envs=32, elbows=elbows, start="on_target")
    _, infos = arms.reset(seed=0)
    assert infos["tracking_error"].max() < 1e-10
    arm, q = arms.unwrapped.episodes.arm, infos["start"]["q"]
    assert joint_positions(arm, q)[:, 2:, 2].min() > -1e-8
    # Joints 2 to 8 are the paper's where the last two links alone reach the circle, which here they mostly do.
    moved = np.abs(q - arms.unwrapped.episodes.pose)[:, 1:8].max(axis=1) > 1e-9
    assert 0 < moved.sum() < 16
    one = gym.make(ENV, elbows=elbows, start="on_target")
    np.testing.assert_array_equal(one.reset(seed=5)[1]["start"]["q"], q[5])

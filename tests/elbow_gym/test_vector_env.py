"""The batched environment, bit for bit the single ones, in every autoreset mode."""

import functools
import itertools
import re

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv
from elbow_gym.kernel.build import kernel
from elbow_gym.kernel.slots import BLOCK_LANES
from tests.support.arms import blow_up

MODES = list(AutoresetMode)
RESETTING = [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP]
RANDOM = {"circle": {"phase": "random"}, "start_noise": 0.1, "duration": 0.16}
HORIZON = 8
ONE_NAN = np.where(np.arange(30).reshape(3, 10) == 17, np.nan, 0.0)
same = functools.partial(data_equivalence, exact=True)


def actions(num_envs, steps, seed=1):
    return np.random.default_rng(seed).uniform(-1.2, 1.2, (steps, num_envs, 10)).astype(np.float32)


def some(num_envs):
    """Every second arm."""
    return np.arange(num_envs) % 2 == 0


def arrays(returned):
    """All arrays in a step's or reset's answer, infos and final infos included."""
    if isinstance(returned, np.ndarray) and returned.dtype != object:
        return [returned]
    parts = returned.values() if isinstance(returned, dict) else returned
    return [] if parts is None else [array for part in parts for array in arrays(part)]


def play(env, steps, seed=3):
    """Answers of a run in which every second arm starts anew midway, so that episodes end at different steps."""
    answers = [env.reset(seed=seed)]
    for count, action in enumerate(actions(env.num_envs, steps)):
        if count == 3:
            answers.append(env.reset(options={"reset_mask": some(env.num_envs)}))
        answers.append(env.step(action))
        over = answers[-1][2] | answers[-1][3]
        if env.metadata["autoreset_mode"] is AutoresetMode.DISABLED and over.any():
            answers.append(env.reset(options={"reset_mask": over}))
    return answers


def test_make_vec_gives_the_native_batch():
    env = gym.make_vec("elbow_gym:ElbowArm-v0", num_envs=3, elbows=1, autoreset_mode="SameStep", num_threads=2)
    assert type(env) is ElbowArmVectorEnv
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    assert env.single_observation_space == ElbowArmEnv().observation_space
    assert (env.observation_space.shape, env.action_space.shape, env.settings.elbows) == ((3, 41), (3, 10), 1)


@pytest.mark.parametrize("start", ["paper", "on_target"])
@pytest.mark.parametrize("elbows", [0, 1, 2])
@pytest.mark.parametrize("num_envs", [1, 2, 5, 17])
def test_batch_equals_single_environments_bit_for_bit_across_autoresets(num_envs, elbows, start):
    settings = {**RANDOM, "elbows": elbows, "start": start}
    singles = [ElbowArmEnv(**settings) for _ in range(num_envs)]
    batch = ElbowArmVectorEnv(num_envs, **settings)
    rows = [(env.reset(seed=40 + i)[0], 0.0, False, False, {}) for i, env in enumerate(singles)]
    assert same(np.stack([row[0] for row in rows]), batch.reset(seed=40)[0])
    for count, action in enumerate(actions(num_envs, 2 * HORIZON + 2)):
        if count == 3:
            batch.reset(options={"reset_mask": some(num_envs)})
            for i in np.flatnonzero(some(num_envs)):
                singles[i].reset()
        answer = batch.step(action)
        for i, (env, (*_, terminated, truncated, _)) in enumerate(zip(singles, rows, strict=True)):
            if terminated or truncated:
                seen, info = env.reset()
                rows[i] = (seen, 0.0, False, False, info)
            else:
                rows[i] = env.step(action[i])
        for i, (seen, *figures, info) in enumerate(rows):
            assert same(seen, answer[0][i])
            assert figures == [column[i] for column in answer[1:4]]
            for key, value in info.items():
                np.testing.assert_array_equal(answer[4][key][i], value)
                assert answer[4][f"_{key}"][i]


def agree(ours, theirs):
    """Infos with the same keys and masks, and the same values where the mask is set."""
    assert set(ours) == set(theirs)
    for key, value in theirs.items():
        if key.startswith("_"):
            np.testing.assert_array_equal(ours[key], value)
        elif isinstance(value, dict):
            agree(ours[key], value)
        else:
            for i in np.flatnonzero(theirs[f"_{key}"]):
                np.testing.assert_array_equal(ours[key][i], value[i])


@pytest.mark.parametrize("elbows", [0, 2])
@pytest.mark.parametrize("mode", MODES)
def test_batch_equals_gymnasiums_own_vector_of_singles_in_every_autoreset_mode(mode, elbows):
    make = functools.partial(gym.make_vec, "ElbowArm-v0", num_envs=4, elbows=elbows, **RANDOM)
    theirs = make(vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode})
    pairs = list(zip(play(make(autoreset_mode=mode), 20), play(theirs, 20), strict=True))
    assert sum(len(answer) == 5 and answer[3].any() for answer, _ in pairs) >= 3
    for (*ours, our_info), (*expected, info) in pairs:
        assert same(ours, expected)
        agree(our_info, info)


def test_energy_weight_applies_to_every_arm_from_the_next_step_on():
    env = ElbowArmVectorEnv(2, tracking_weight=0.0, **RANDOM)
    env.reset(seed=0)
    env.set_energy_weight(0.5)
    _, reward, *_, info = env.step(actions(2, 1)[0])
    np.testing.assert_allclose(reward, -0.5 * info["electrical_power"], rtol=1e-12)


def test_same_step_hands_the_finished_episode_in_final_obs_and_final_info():
    env = ElbowArmVectorEnv(3, autoreset_mode="SameStep", **RANDOM)
    *_, (_, reward, _, truncated, info) = play(env, HORIZON)
    over, final = [False, True, False], info["final_info"]
    assert truncated.tolist() == info["_final_obs"].tolist() == info["_final_info"].tolist() == over
    assert [last is not None for last in info["final_obs"]] == over
    assert reward[1] == final["reward_tracking"][1] + final["reward_energy"][1]
    error = np.linalg.norm(env.decode(info["final_obs"][1])["hand_error"])
    assert final["tracking_error"][1] == pytest.approx(error, rel=1e-6)
    assert final["drawn_energy"][1] > 0.0 == info["drawn_energy"][1]


def test_arm_that_leaves_float64_ends_alone():
    env = ElbowArmVectorEnv(20, **RANDOM)
    play(env, 2)
    state = env.get_state()
    undisturbed = env.step(actions(20, 1)[0])
    env.set_state(state)
    blow_up(env, 1)
    answer = env.step(actions(20, 1)[0])
    others = np.arange(20) != 1
    np.testing.assert_array_equal(answer[2], ~others)
    assert answer[0] in env.observation_space
    for ours, expected in zip(answer[:4], undisturbed[:4], strict=True):
        assert same(ours[others], expected[others])


@pytest.mark.parametrize("mode", MODES)
def test_answers_of_successive_calls_share_no_memory(mode):
    env = ElbowArmVectorEnv(3, autoreset_mode=mode, **RANDOM)
    returned = [*map(arrays, play(env, HORIZON + 3)), env.episodes.simulator.raw]
    for earlier, later in itertools.combinations(returned, 2):
        assert not any(np.shares_memory(a, b) for a in earlier for b in later)


@pytest.mark.parametrize("mode", RESETTING)
def test_continuing_from_a_saved_state_is_bit_identical_generators_included(mode):
    env, other = (ElbowArmVectorEnv(3, autoreset_mode=mode, **RANDOM) for _ in range(2))
    play(env, HORIZON)
    state = env.get_state()
    ahead = [env.step(action) for action in actions(3, HORIZON + 2)]
    other.set_state(state)
    assert same(ahead, [other.step(action) for action in actions(3, HORIZON + 2)])


def test_disabled_refuses_arms_that_are_over_until_they_are_reset():
    env = ElbowArmVectorEnv(2, autoreset_mode="Disabled", **RANDOM)
    env.reset(seed=0)
    for action in actions(2, HORIZON):
        env.step(action)
    for over, mask in (("[0 1]", [True, False]), ("[1]", [False, True])):
        with pytest.raises(gym.error.ResetNeeded, match=re.escape(over)):
            env.step(action)
        env.reset(options={"reset_mask": np.array(mask)})
    assert not env.step(action)[3].any()


@pytest.mark.parametrize("kind", [int, np.int64, np.uint8])
def test_seeds_may_be_numpys_integers(kind):
    env = ElbowArmVectorEnv(2, **RANDOM)
    expected, _ = env.reset(seed=3)
    for seed in (kind(3), [kind(3), kind(4)], np.array([3, 4], dtype=kind)):
        np.testing.assert_array_equal(env.reset(seed=seed)[0], expected)
        assert env.np_random_seed == (3, 4)
    np.testing.assert_array_equal(ElbowArmEnv(**RANDOM).reset(seed=kind(3))[0], expected[0])


def test_attributes_and_calls_are_those_of_gymnasiums_own_vector():
    ours = gym.make_vec("elbow_gym:ElbowArm-v0", 2, render_mode="rgb_array", **RANDOM)
    theirs = gym.make_vec("ElbowArm-v0", 2, vectorization_mode="sync", render_mode="rgb_array", **RANDOM)
    for env in (ours, theirs):
        env.reset(seed=5)
    for name in ("action_space", "observation_space", "render_mode", "observation_names", "energy_weight", "duration"):
        assert ours.get_attr(name) == theirs.get_attr(name)
    assert same(ours.call("render"), theirs.call("render"))
    assert ours.call("set_energy_weight", 0.5) == theirs.call("set_energy_weight", 0.5)
    for weights in (0.5, [0.25, 0.25], (0.0, 0.0)):
        for env in (ours, theirs):
            env.set_attr("energy_weight", weights)
        assert ours.get_attr("energy_weight") == theirs.get_attr("energy_weight")
        assert same(ours.step(actions(2, 1)[0])[1], theirs.step(actions(2, 1)[0])[1])
    assert [one.bit_generator.state for one in ours.get_attr("np_random")] == [
        one.bit_generator.state for one in theirs.get_attr("np_random")
    ]
    for wrong in ([0.1, 0.2], [0.1]):
        with pytest.raises(ValueError, match=r"^energy_weight must be the same for all 2 arms of a batch, got \[0.1"):
            ours.set_attr("energy_weight", wrong)
    for name in ("reset", "step", "get_state"):
        with pytest.raises(ValueError, match=f"^{name} must be called on the batch itself"):
            ours.call(name)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("drawn", [{"randomize": {"mass": [0.9, 1.1], "payload": [0.0, 0.1]}}, {}])
def test_what_was_drawn_is_in_the_infos_of_resets_and_steps_as_in_gymnasiums_own_vector(mode, drawn):
    settings = {**RANDOM, "circle": {"radius": [0.05, 0.1], "period": [4.0, 6.0], "phase": "random"}, **drawn}
    make = functools.partial(gym.make_vec, "elbow_gym:ElbowArm-v0", num_envs=3, **settings)
    ours = play(make(autoreset_mode=mode), 2 * HORIZON)
    theirs = play(make(vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}), 2 * HORIZON)
    keys = {key for key in ours[0][-1] if not key.startswith("_")}
    assert {"circle", *(["parameters"] if drawn else [])} <= keys
    for answer, expected in zip(ours, theirs, strict=True):
        agree(answer[-1], expected[-1])
        assert {key for key in answer[-1] if not key.startswith("_")} - {"final_obs", "final_info"} == keys


def test_parameters_given_to_one_episode_are_in_its_infos_alone():
    env = ElbowArmVectorEnv(2, autoreset_mode="SameStep", duration=0.04)
    env.reset(seed=0, options={"parameters": {"payload": 0.2}})
    np.testing.assert_array_equal(env.step(actions(2, 1)[0])[4]["parameters"]["payload"], 0.2)
    *_, last = env.step(actions(2, 1)[0])
    np.testing.assert_array_equal(last["final_info"]["parameters"]["payload"], 0.2)
    assert "parameters" not in last
    assert "parameters" not in env.step(actions(2, 1)[0])[4]


def test_seed_of_arm_i_is_the_integer_plus_i_or_the_lists_entry():
    env = ElbowArmVectorEnv(3, **RANDOM)
    by_integer, _ = env.reset(seed=5)
    assert env.np_random_seed == (5, 6, 7)
    by_list, _ = env.reset(seed=[7, 5, 6])
    np.testing.assert_array_equal(by_list, by_integer[[2, 0, 1]])
    going_on, _ = env.reset()
    again, _ = env.reset(seed=[7, None, 6])
    np.testing.assert_array_equal(again[[0, 2]], by_list[[0, 2]])
    assert len({row.tobytes() for row in (*by_integer, going_on[1], again[1])}) == 5


@pytest.mark.parametrize(
    ("call", "arguments", "message"),
    [
        ("reset", {"seed": [1, 2]}, r"seed must be an integer or one per arm \(3\), got 2"),
        ("reset", {"seed": [8, -1, 8]}, "Seed must be "),
        ("reset", {"seed": 1.5}, r"seed must be an integer or one per arm \(3\), got 1.5"),
        ("reset", {"seed": [8, 1.5, 8]}, r"seed must be an integer or one per arm \(3\), got \[8, 1.5, 8\]"),
        ("reset", {"options": {"reset_mask": np.array([1, 0, 1])}}, r"options\['reset_mask'\] must be a bool array"),
        ("reset", {"options": {"reset_mask": np.array([True])}}, r"options\['reset_mask'\] must be .* \(3,\), got "),
        ("reset", {"options": {"reset_mask": np.zeros(3, bool)}}, r"options\['reset_mask'\] must choose at least"),
        ("reset", {"seed": 8, "options": {"phase": np.nan}}, "phase must be finite, got nan"),
        ("reset", {"seed": 8, "options": {"pose": 0}}, "options must have only .*, got 'pose'"),
        ("step", {"actions": ONE_NAN}, r"action must not be NaN, got \[.*nan, 0.0, 0.0\]$"),
        ("step", {"actions": np.zeros(10)}, r"action must have shape \(3, 10\), got \(10,\)$"),
    ],
)
def test_wrong_call_is_an_error_that_leaves_everything_untouched(call, arguments, message):
    env = ElbowArmVectorEnv(3, **RANDOM)
    play(env, 5)
    before = env.get_state()
    with pytest.raises((ValueError, gym.error.Error), match=f"^{message}"):
        getattr(env, call)(**arguments)
    assert same(env.get_state(), before)


@pytest.mark.parametrize("order", [np.asfortranarray, lambda action: np.repeat(action, 2, axis=1)[:, ::2], np.float64])
def test_neither_memory_order_nor_precision_of_the_actions_changes_a_bit_or_has_anything_compiled(order):
    env, twin = ElbowArmVectorEnv(3), ElbowArmVectorEnv(3)
    for one in (env, twin):
        one.reset(seed=0)
    expected = [twin.step(action) for action in actions(3, 3)]
    compiled = [kernel(BLOCK_LANES).control_step]
    before = [entry.signatures for entry in compiled]
    assert same([env.step(order(action)) for action in actions(3, 3)], expected)
    assert [entry.signatures for entry in compiled] == before


@pytest.mark.parametrize("mode", MODES)
def test_arm_that_was_never_reset_does_not_step(mode):
    env = ElbowArmVectorEnv(2, autoreset_mode=mode)
    assert len(env.np_random) == 2
    with pytest.raises(gym.error.ResetNeeded, match=r"^reset must be called"):
        env.step(actions(2, 1)[0])
    env.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(gym.error.ResetNeeded, match=r"^reset must be called"):
        env.step(actions(2, 1)[0])


@pytest.mark.parametrize("mode", MODES)
def test_gymnasiums_episode_statistics_count_returns_and_lengths_of_every_episode(mode):
    if mode is AutoresetMode.SAME_STEP and tuple(map(int, gym.__version__.split(".")[:2])) < (1, 4):
        pytest.skip("Gymnasium before 1.4 counts episodes in SameStep as if they were reset in the next step")
    env = RecordEpisodeStatistics(ElbowArmVectorEnv(2, autoreset_mode=mode, **RANDOM))
    env.reset(seed=0)
    for _ in range(3):
        answers = [env.step(action) for action in actions(2, HORIZON)]
        episode = answers[-1][4]["episode"]
        np.testing.assert_allclose(episode["r"], sum(answer[1] for answer in answers), rtol=1e-12)
        np.testing.assert_array_equal(episode["l"], HORIZON)
        if mode is AutoresetMode.NEXT_STEP:
            assert not env.step(actions(2, 1)[0])[1].any()
        if mode is AutoresetMode.DISABLED:
            env.reset(options={"reset_mask": np.ones(2, dtype=np.bool_)})


@pytest.mark.parametrize(
    ("name", "value"),
    [("num_envs", 0), ("num_threads", 1.5), ("render_mode", "hologram"), ("autoreset_mode", "Never")],
)
def test_wrong_argument_is_a_value_error_naming_it_and_its_value(name, value):
    with pytest.raises(ValueError, match=f"^{name} must be .*, got {value!r}$"):
        ElbowArmVectorEnv(**{name: value})


def test_resetting_one_arm_leaves_what_the_others_have_paid():
    env = ElbowArmVectorEnv(2, regeneration=False, autoreset_mode="Disabled")
    env.reset(seed=0)
    _, _, _, _, before = env.step(actions(2, 1)[0])
    env.reset(options={"reset_mask": np.array([True, False])})
    _, _, _, _, after = env.step(-actions(2, 1)[0])
    drawn = after["drawn_energy"][1] - before["drawn_energy"][1]
    assert after["electrical_power"][1] == pytest.approx(50.0 * drawn, rel=1e-12)

"""The environments' pictures under Gymnasium's rules: modes, wrappers, batches, windows, and untouched physics."""

import copy
import functools
import pickle
import sys

import gymnasium as gym
import numpy as np
import pygame
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.wrappers import HumanRendering, RecordVideo
from gymnasium.wrappers.vector import RecordVideo as RecordVectorVideo
from imageio_ffmpeg import count_frames_and_secs

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv
from elbow_gym.rendering.screen import Window
from elbow_gym.rendering.viewer import RENDER_MODES, Viewer

SMALL = {"render_width": 160, "render_height": 120}
ACTIONS = np.random.default_rng(2).uniform(-1.0, 1.0, (12, 10)).astype(np.float32)
same = functools.partial(data_equivalence, exact=True)


@pytest.fixture
def no_display(monkeypatch):
    """Fails what opens a display or initialises all of pygame."""

    def refuse(*_args):
        raise AssertionError("a display was opened")

    monkeypatch.setattr(pygame, "init", refuse)
    monkeypatch.setattr(pygame.display, "init", refuse)
    monkeypatch.setattr(pygame.display, "set_mode", refuse)


@pytest.fixture
def shown(monkeypatch):
    """The pictures and rates that windows are given."""
    calls = []
    monkeypatch.setattr(Window, "show", lambda _, pixels, rate: calls.append((pixels.shape, rate)))
    return calls


def started(steps=3, **settings):
    env = ElbowArmEnv(**SMALL, **settings)
    env.reset(seed=1)
    for action in ACTIONS[:steps]:
        env.step(action)
    return env


@pytest.mark.slow
@pytest.mark.parametrize("mode", RENDER_MODES)
@pytest.mark.parametrize("name", ["ElbowArm-v0", "ElbowArmTable-v0", "ElbowArmRandom-v0", "ElbowArmTasks-v0"])
def test_both_checkers_find_nothing_in_any_mode(name, mode):
    env = gym.make(f"elbow_gym:{name}", render_mode=mode, **SMALL)
    check_env(env.unwrapped)
    sb3 = pytest.importorskip("stable_baselines3.common.env_checker")
    sb3.check_env(env, skip_render_check=False)


@pytest.mark.parametrize("size", [(640, 480), (200, 300)])
def test_picture_is_a_fresh_array_of_the_size_asked_for(size, no_display):
    env = ElbowArmEnv(render_mode="rgb_array", render_width=size[0], render_height=size[1])
    env.reset(seed=0)
    first, second = env.render(), env.render()
    assert (first.shape, first.dtype) == ((size[1], size[0], 3), np.uint8)
    assert first.flags.writeable
    assert not np.shares_memory(first, second)
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("frequency", [50.0, 25.0])
def test_frames_per_second_are_the_control_rate(frequency):
    assert gym.make("elbow_gym:ElbowArm-v0", control_frequency=frequency).metadata["render_fps"] == frequency
    assert gym.make_vec("elbow_gym:ElbowArm-v0", control_frequency=frequency).metadata["render_fps"] == frequency


@pytest.mark.parametrize("settings", [{"elbows": 2}, {"elbows": 0, "table": True, "randomize": {"length": [0.9, 1.0]}}])
def test_watching_changes_neither_physics_nor_random_numbers(settings):
    def run(mode):
        env = ElbowArmEnv(render_mode=mode, **SMALL, **settings)
        answers = [env.reset(seed=4)]
        for action in ACTIONS:
            answers.append(env.step(action))
            if mode == "rgb_array":
                env.render()
        return [*answers, env.reset()]

    assert same(run(None), run("rgb_array"))


def test_picture_moves_with_the_arm_and_repeats_with_the_seed():
    env = started(steps=0, render_mode="rgb_array")
    first = env.render()
    for action in ACTIONS:
        env.step(action)
    assert (env.render() != first).any(axis=-1).mean() > 0.005
    env.reset(seed=1)
    np.testing.assert_array_equal(env.render(), first)


def test_batch_shows_what_single_environments_show_across_autoresets():
    settings = {"render_mode": "rgb_array", "duration": 0.08, "randomize": {"length": [0.95, 1.05]}, **SMALL}
    for mode in ("NextStep", "SameStep"):
        batch = gym.make_vec("elbow_gym:ElbowArm-v0", num_envs=3, autoreset_mode=mode, **settings)
        singles = [ElbowArmEnv(**settings) for _ in range(3)]
        batch.reset(seed=7)
        over = [env.reset(seed=7 + i) is None for i, env in enumerate(singles)]
        for action in ACTIONS[:6]:
            batch.step(np.tile(action, (3, 1)))
            for i, env in enumerate(singles):
                if over[i]:
                    env.reset()
                    over[i] = False
                    continue
                over[i] = env.step(action)[3]
                if over[i] and mode == "SameStep":
                    env.reset()
                    over[i] = False
            pictures = batch.render()
            assert isinstance(pictures, tuple)
            for env, picture in zip(singles, pictures, strict=True):
                np.testing.assert_array_equal(picture, env.render())
        batch.close()


def test_trace_is_where_the_hand_was_since_the_reset():
    env = ElbowArmEnv(**SMALL)
    env.reset(seed=1)
    seen = Viewer(env.episodes, "rgb_array")
    for _ in range(2):
        env.reset()
        seen.restart()
        hands = [env.episodes.simulator.hand_position[0].copy()]
        for action in ACTIONS:
            env.step(action)
            seen.follow()
            hands.append(env.episodes.simulator.hand_position[0].copy())
        scene = seen.scene()
        np.testing.assert_array_equal(scene.trace[:-1], hands)
        np.testing.assert_allclose(scene.trace[-1], hands[-1], atol=1e-12)


def test_drawn_arm_is_seen_with_its_own_lengths():
    env = ElbowArmEnv(elbows=0, randomize={"length": [0.85, 0.95]})
    env.reset(seed=1)
    seen = Viewer(env.episodes, "rgb_array")
    seen.restart()
    np.testing.assert_allclose(seen.scene().joints[-1], env.episodes.simulator.hand_position[0], atol=1e-12)


def test_friction_of_the_table_is_seen_along_and_across_the_arms_radius():
    env = ElbowArmEnv(elbows=0, table={"friction": 0.5})
    env.reset(seed=1)
    seen = Viewer(env.episodes, "rgb_array")
    seen.restart()
    for _ in range(20):
        env.step(np.eye(10)[0])
    yaw, force = env.episodes.simulator.q[0, 0], env.episodes.simulator.contact_force[0]
    out = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    across = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    assert abs(yaw) > 0.1
    assert np.abs(force[:, 1]).max() > 0.1
    np.testing.assert_allclose(seen.scene().forces @ np.stack([out, across, np.eye(3)[2]]).T, force, atol=1e-12)


def test_power_is_the_mean_of_the_last_tenth_of_a_second():
    env = ElbowArmEnv(**SMALL)
    env.reset(seed=1)
    seen = Viewer(env.episodes, "rgb_array")
    seen.restart()
    powers = []
    for action in ACTIONS:
        powers.append(env.step(action)[4]["electrical_power"])
        seen.follow()
        assert seen.scene().power.sum() == pytest.approx(np.mean(powers[-5:]), rel=1e-9)


def test_going_back_to_a_state_forgets_the_trace():
    env = started(render_mode="rgb_array")
    state = env.get_state()
    for action in ACTIONS:
        env.step(action)
    env.set_state(state)
    assert len(env._viewer.scene().trace) == 2


def test_record_video_writes_one_frame_a_step(tmp_path):
    env = RecordVideo(
        gym.make("elbow_gym:ElbowArm-v0", render_mode="rgb_array", duration=0.2, **SMALL), str(tmp_path / "v")
    )
    env.reset(seed=0)
    while not env.step(env.action_space.sample())[3]:
        pass
    env.close()
    (video,) = (tmp_path / "v").glob("*.mp4")
    # One of the start and one of each step; moviepy may round the last one off.
    assert count_frames_and_secs(str(video))[0] in (10, 11)


def test_record_video_takes_a_batch_too(tmp_path):
    batch = gym.make_vec("elbow_gym:ElbowArm-v0", num_envs=2, render_mode="rgb_array", duration=0.1, **SMALL)
    env = RecordVectorVideo(batch, str(tmp_path / "v"), video_length=4, episode_trigger=lambda episode: episode == 0)
    env.reset(seed=0)
    for _ in range(6):
        env.step(ACTIONS[:2])
    env.close()
    # Gymnasium adds the start to the steps that it was asked for.
    assert [count_frames_and_secs(str(video))[0] for video in (tmp_path / "v").glob("*.mp4")] == [5]


def test_gymnasiums_own_window_takes_the_pictures():
    env = HumanRendering(gym.make("elbow_gym:ElbowArm-v0", render_mode="rgb_array", **SMALL))
    env.reset(seed=0)
    env.step(ACTIONS[0])
    env.close()
    # They quit pygame; the next picture does without what they took.
    assert started(render_mode="rgb_array").render().std() > 10.0


@pytest.mark.parametrize("kind", [ElbowArmEnv, ElbowArmVectorEnv])
def test_window_goes_and_may_be_closed_twice(kind):
    env = kind(render_mode="human", **SMALL)
    env.reset(seed=0)
    assert pygame.display.get_surface().get_size() == (160, 120)
    assert env.render() is None
    env.close()
    assert not pygame.display.get_init()
    env.close()


def test_closing_one_environment_leaves_anothers_window():
    first, second = started(render_mode="human"), started(render_mode="human")
    first.close()
    assert pygame.display.get_init()
    second.close()
    assert not pygame.display.get_init()


def test_closing_the_window_leaves_the_arm_running_without_it():
    env = started(render_mode="human")
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    for action in ACTIONS[:3]:
        env.step(action)
    assert not pygame.display.get_init()


@pytest.mark.parametrize(("frequency", "steps", "pictures"), [(50.0, 12, 12), (2000.0, 680, 20)])
def test_window_shows_at_most_sixty_pictures_a_second_at_the_arms_pace(frequency, steps, pictures, shown):
    env = ElbowArmEnv(render_mode="human", control_frequency=frequency, **SMALL)
    env.reset(seed=0)
    shown.clear()
    for _ in range(steps):
        env.step(np.zeros(10))
    assert len(shown) == pictures
    assert shown[0] == ((120, 160, 3), pytest.approx(frequency * pictures / steps))


@pytest.mark.parametrize(
    ("arms", "shape"), [(1, (120, 160, 3)), (2, (120, 320, 3)), (3, (240, 320, 3)), (9, (240, 320, 3))]
)
def test_window_of_a_batch_shows_its_first_four_arms(arms, shape, shown):
    ElbowArmVectorEnv(arms, render_mode="human", **SMALL).reset(seed=0)
    assert shown[0][0] == shape


@pytest.mark.parametrize("kind", [ElbowArmEnv, ElbowArmVectorEnv])
@pytest.mark.parametrize("mode", RENDER_MODES)
def test_picture_before_a_reset_needs_a_reset(kind, mode):
    with pytest.raises(gym.error.ResetNeeded, match=r"^reset must be called before render$"):
        kind(render_mode=mode).render()


@pytest.mark.parametrize("kind", [ElbowArmEnv, ElbowArmVectorEnv])
def test_picture_without_a_mode_is_a_warning(kind):
    env = kind()
    env.reset(seed=0)
    with pytest.warns(UserWarning, match=r"render needs a render_mode, one of \['human', 'rgb_array'\]"):
        assert env.render() is None


def test_missing_pygame_names_what_to_install(monkeypatch):
    env = started(render_mode="rgb_array")
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(
        gym.error.DependencyNotInstalled, match=r'^pygame-ce .*, run `pip install "elbow-gym\[render\]"`$'
    ):
        env.render()


@pytest.mark.parametrize("kind", [ElbowArmEnv, ElbowArmVectorEnv])
@pytest.mark.parametrize(
    ("name", "value"),
    [("render_width", 63), ("render_height", 480.0), ("render_width", True), ("render_mode", "ansi")],
)
def test_wrong_argument_is_a_value_error_naming_it_and_its_value(kind, name, value):
    with pytest.raises(ValueError, match=f"^{name} must be .*, got {value!r}$"):
        kind(**{name: value})


def test_watched_environment_travels_and_is_copied():
    env = started(render_mode="rgb_array")
    picture = env.render()
    for twin in (pickle.loads(pickle.dumps(env)), copy.deepcopy(env)):
        np.testing.assert_array_equal(twin.render(), picture)
        assert same(twin.step(ACTIONS[5]), copy.deepcopy(env).step(ACTIONS[5]))

"""`python -m agents watch`: videos with the pictures asked for, two controllers in step, windows that go away."""

from dataclasses import replace

import numpy as np
import pytest
from imageio_ffmpeg import count_frames_and_secs, read_frames
from PIL import Image

from agents.__main__ import app
from agents.evaluation.players import find_player
from agents.style import CONTROLLER_COLOURS, look
from agents.watch import watch as watching
from agents.watch.video import write_video
from agents.watch.watch import Performance, frames, label, rgb, watch
from elbow_gym.rendering.screen import Window

SIZE = (160, 120)
LABELLED = 120 + round(30.0 * 0.25)


@pytest.fixture(autouse=True)
def short_episodes(monkeypatch):
    """Episodes of 0.3 s."""

    def short(*arguments):
        player = find_player(*arguments)
        return replace(player, settings=replace(player.settings, duration=0.3))

    monkeypatch.setattr(watching, "find_player", short)


def performance(name="pd", elbows=2):
    return Performance(name, "ElbowArm-v0", elbows, "paper", SIZE)


def test_gif_shows_both_controllers_side_by_side_to_the_end_of_the_episode(tmp_path):
    path = tmp_path / "both.gif"
    assert watch(["pd", "ppo"], elbows=2, size=SIZE, output=path) == path
    with Image.open(path) as gif:
        assert gif.size == (320, LABELLED)
        durations, pictures = [], []
        for k in range(gif.n_frames):
            gif.seek(k)
            durations.append(gif.info["duration"])
            pictures.append(np.asarray(gif.convert("RGB")).astype(int))
    # Five steps of 60 ms, and the last picture stays.
    assert durations == [60] * 5 + [2060]
    for k, name in enumerate(("pd", "ppo")):
        band = pictures[-1][-2, 160 * k : 160 * (k + 1)]
        assert (np.abs(band - rgb(look(name)[1])).max(axis=-1) < 16).mean() > 0.5
    for half in (slice(0, 160), slice(160, 320)):
        assert np.abs(pictures[-1][:120, half] - pictures[0][:120, half]).max() > 60


def test_mp4_has_the_frames_and_the_size(tmp_path):
    path = watch(["pd"], elbows=1, size=SIZE, speed=0.5, output=tmp_path / "one.mp4")
    # 0.3 s at half the speed, 25 a second, the start, and two seconds of the end.
    assert count_frames_and_secs(str(path))[0] == 15 + 1 + 50
    assert next(read_frames(str(path)))["size"] == (160, LABELLED // 2 * 2)


def test_arms_are_at_the_same_time_in_every_picture():
    both = [performance("pd"), performance("ppo")]
    spread = []
    for _ in frames(both, 3, 25.0, 1.0):
        times = [one._env.episodes.simulator.time[0] for one in both]
        spread.append(times)
    np.testing.assert_allclose(np.diff(spread, axis=1), 0.0, atol=0.02 + 1e-9)
    # 25 pictures a second are whole control periods apart.
    np.testing.assert_allclose(spread[:-1], np.arange(8)[:, None] * 0.04 * np.ones(2), atol=1e-9)
    np.testing.assert_allclose(spread[-1], 0.3, atol=1e-9)


def test_both_start_from_the_same_pose_which_the_seed_draws():
    first, second = performance("pd"), performance("ppo")
    poses = {}
    for seed in (3, 4):
        for one in (first, second):
            one.restart(seed)
        poses[seed] = first._env.episodes.simulator.q.copy()
        np.testing.assert_array_equal(poses[seed], second._env.episodes.simulator.q)
    assert (poses[3] != poses[4]).any()


def test_time_stands_still_at_the_end_of_an_episode():
    one = performance()
    one.restart(0)
    one.advance(10.0)
    assert one._env.episodes.simulator.time[0] == pytest.approx(0.3)


def test_without_a_display_the_file_is_named_after_the_controllers(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = watch(["pd", "pd_smooth"], size=SIZE, speed=10.0)
    assert str(path) == "pd_versus_pd_smooth.mp4"
    assert path.stat().st_size > 1000
    assert "no display: writing pd_versus_pd_smooth.mp4" in capsys.readouterr().err


def test_window_plays_episode_after_episode_until_it_is_closed(monkeypatch):
    seen = []

    def show(window, pixels, rate):
        seen.append((pixels.shape, rate))
        window.closed = len(seen) == 40

    monkeypatch.setattr(Window, "show", show)
    monkeypatch.setattr(watching, "display_driver", lambda: "x11")
    assert watch(["pd"], size=SIZE) is None
    # 16 pictures an episode at 50 a second.
    assert seen == [((LABELLED, 160, 3), 50.0)] * 40


@pytest.mark.parametrize("stop", [KeyboardInterrupt, RuntimeError])
def test_window_goes_whatever_ends_the_show(stop, monkeypatch):
    closed = []

    def fail(*_args):
        raise stop

    monkeypatch.setattr(Window, "show", fail)
    monkeypatch.setattr(Window, "close", lambda _: closed.append(True))
    monkeypatch.setattr(watching, "display_driver", lambda: "x11")
    try:
        assert watch(["pd"], size=SIZE) is None
    except RuntimeError:
        assert stop is RuntimeError
    # Gymnasium 1.2 closes a second time when the environment is collected.
    assert closed


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"output": "film.avi"}, r"output must end in one of \['.gif', '.mp4'\], got 'film.avi'"),
        ({"speed": 0.0}, "speed must be positive, got 0.0"),
        ({"size": (16, 120)}, "render_width must be .*, got 16"),
        ({"elbows": 9}, "elbows must be .*, got 9"),
    ],
)
def test_wrong_argument_is_a_value_error_before_anything_is_written(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if "output" in arguments:
        arguments = {"output": tmp_path / arguments["output"]}
    with pytest.raises(ValueError, match=f"^{message}"):
        watch(["pd"], **{"size": SIZE, **arguments})
    assert not list(tmp_path.iterdir())


def test_command_line_writes_the_file_and_says_where(tmp_path, capsys):
    path = tmp_path / "table.gif"
    words = f"watch pd --env ElbowArmTable-v0 --speed 5 --size 160 120 --start on_target --output {path}"
    app.run(words.split())
    assert capsys.readouterr().out == f"{path}\n"
    with Image.open(path) as gif:
        assert gif.n_frames == 2


def test_interrupted_video_leaves_no_file(tmp_path):
    def interrupted():
        yield np.zeros((8, 8, 3), dtype=np.uint8)
        raise KeyboardInterrupt

    for name in ("film.gif", "film.mp4"):
        with pytest.raises(KeyboardInterrupt):
            write_video(tmp_path / name, interrupted(), 25.0)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", CONTROLLER_COLOURS)
def test_label_is_in_the_controllers_colour_with_readable_letters(name):
    title, colour, _ = look(name)
    colour = rgb(colour)
    strip = label(title, colour, (640, 480)).astype(int)
    np.testing.assert_array_equal(strip[0, 0], colour)
    channels = np.array([strip[0, 0], strip.reshape(-1, 3)[np.abs(strip - colour).sum(axis=-1).argmax()]]) / 255.0
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    low, high = sorted(linear @ [0.2126, 0.7152, 0.0722])
    # WCAG's contrast for large letters.
    assert (high + 0.05) / (low + 0.05) >= 3.0

"""Pictures of an arm: pixels where the projection puts them, colours by force, bars by power."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pygame
import pytest
from PIL import Image

from elbow_gym import ElbowArmEnv, paper_arm
from elbow_gym.kinematics import joint_positions
from elbow_gym.rendering.painter import ELBOW, INK, PULL, PUSH, TRACE
from elbow_gym.rendering.scene import cut_at_table
from elbow_gym.rendering.viewer import Viewer
from elbow_gym.task.circle import Circle
from tests.make_golden import GOLDEN, picture

SIZES = [(640, 480), (1280, 720), (320, 240)]


def viewer(size=(640, 480), **settings):
    env = ElbowArmEnv(start_noise=0.0, **settings)
    env.reset(seed=0)
    seen = Viewer(env.episodes, "rgb_array", *size)
    seen.restart()
    return seen


def near(pixels, colour, tolerance=24):
    """Where a picture has a colour, (height, width)."""
    return (np.abs(pixels.astype(int) - colour) <= tolerance).all(axis=-1)


def around(mask, pixel, reach=3):
    """Whether the mask is true somewhere around a pixel."""
    x, y = np.round(pixel).astype(int)
    return bool(mask[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1].any())


def scene_part(pixels):
    """The picture without its words and bars."""
    height = len(pixels)
    return pixels[round(0.19 * height) : round(0.73 * height)]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("circle", [{}, {"radius": 0.4, "center": [1.3, 0.6, 0.2]}, {"plane": "xz"}], ids=str)
def test_circle_is_where_the_projection_says_and_nowhere_else(circle, size):
    seen = viewer(size, circle=circle)
    pixels = seen.picture().astype(int)
    luminance = pixels.mean(axis=-1)
    path = Circle.from_dict(circle).position(np.linspace(0.0, 2.0 * np.pi, 60))
    here = seen.renderer.camera.project(path)
    # Shades of the arm's shadow and of the path's own are lighter than this.
    dark = luminance < 170.0
    assert all(around(dark, pixel, 2) for pixel in here)
    other = viewer(size, circle={**circle, "center": [1.4, 1.2, 0.7]}).picture().mean(axis=-1) < 170.0
    assert np.mean([around(other, pixel, 1) for pixel in here]) < 0.5


@pytest.mark.parametrize("yaw", [0.0, 0.5, 1.2])
def test_hand_and_base_are_where_the_state_puts_them(yaw):
    seen = viewer(elbows=0)
    pose = np.array(paper_arm().nominal_pose)
    pose[0] = yaw
    seen._episodes.simulator.reset(pose)
    seen.restart()
    camera, pixels = seen.renderer.camera, seen.picture()
    hand = camera.project(joint_positions(paper_arm(), pose)[-1])
    blue = near(pixels, TRACE, 60)
    assert around(blue, hand, 2)
    y, x = np.nonzero(blue[90:350])
    # The hand alone is of that colour here: nothing has moved, so there is no trace.
    np.testing.assert_allclose([x.mean(), 90 + y.mean()], hand, atol=3.0)
    assert around(pixels.mean(axis=-1) < 140.0, camera.project(np.zeros(3)), 2)


def test_elbows_are_marked_where_they_rest_on_the_table():
    seen = viewer(elbows=(4, 7))
    mask = near(seen.picture(), ELBOW, 30)
    joints = joint_positions(paper_arm(), paper_arm().nominal_pose)
    marked = [around(mask, seen.renderer.camera.project(joint), 4) for joint in joints]
    assert [k + 1 for k, found in enumerate(marked) if found] == [4, 7]


@pytest.mark.parametrize(("force", "pushes", "pulls"), [(5.0, True, False), (-5.0, False, True), (0.0, False, False)])
def test_arrows_tell_pushing_from_pulling(force, pushes, pulls):
    seen = viewer(elbows=1)
    scene = replace(seen.scene(), forces=np.array([[0.0, 0.0, force]]))
    part = scene_part(seen.renderer.draw(scene))
    assert (near(part, PUSH, 8).sum() > 30) == pushes
    assert (near(part, PULL, 8).sum() > 30) == pulls


def test_arrow_grows_with_the_force():
    seen = viewer(elbows=1)
    counts = []
    for force in (1.0, 4.0, 20.0):
        scene = replace(seen.scene(), forces=np.array([[0.0, 0.0, force]]))
        counts.append(near(scene_part(seen.renderer.draw(scene)), PUSH, 8).any(axis=1).sum())
    assert counts == sorted(set(counts))


def test_compliant_table_shows_forces_where_it_bears():
    env = ElbowArmEnv(elbows=0, table=True, start_noise=0.0)
    env.reset(seed=0)
    seen = Viewer(env.episodes, "rgb_array")
    seen.restart()
    for _ in range(10):
        env.step(np.zeros(10))
    bearing = [int(k) + 3 for k in np.flatnonzero(env.episodes.simulator.contact_force[0, :, 2])]
    scene = seen.scene()
    assert bearing
    assert list(scene.elbows) == bearing
    assert scene.support == (str(len(bearing)), "on the table")
    assert near(scene_part(seen.picture()), PUSH, 8).sum() > 30


@pytest.mark.parametrize("watts", [1000.0, 30.0, 2.0, 0.0, -8.0])
def test_bars_are_as_high_as_the_axis_says(watts):
    seen = viewer()
    power = np.zeros(10)
    power[4] = watts
    pixels = seen.renderer.draw(replace(seen.scene(), power=power))
    rows = near(pixels[375:465], TRACE if watts > 0 else (128, 185, 217), 20).any(axis=1).sum()
    # From -10 W at the bottom to 1000 W at the top, 78 pixels, by log(1 + |P| / 0.1 W).
    low, high = (math.log(1.0 + bound / 0.1) for bound in (10.0, 1000.0))
    assert rows == pytest.approx(78.0 * math.log(1.0 + abs(watts) / 0.1) / (low + high), abs=1.1)


def test_links_below_the_table_are_cut_off_at_its_top():
    joints = np.array([[0.0, 0.0, 0.2], [0.3, 0.0, -0.1], [0.6, 0.0, -0.3], [0.9, 0.0, 0.1]])
    pieces = cut_at_table(joints, np.array([4.0, 3.0, 2.0, 1.0]), 0.0)
    assert [under for *_, under in pieces] == [False, True, True, True, False]
    (_, cut), thickness, _ = pieces[0]
    np.testing.assert_allclose(cut, [0.2, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(thickness, [4.0, 4.0 - 2.0 / 3.0], atol=1e-12)
    for before, after in pairwise(pieces):
        np.testing.assert_array_equal(before[0][1], after[0][0])


@pytest.mark.parametrize(("joints", "length"), [(4, 0.5), (20, 0.1), (40, 0.01)])
def test_other_arms_are_framed_too(joints, length):
    plain = paper_arm().to_dict()
    link, motor = {"length": length, "mass": 0.05, "radius": 0.01}, plain["motors"][0]
    arm = {
        "links": [{**link, "length": 0.0}, *[link] * (joints - 1)],
        "motors": [motor] * joints,
        "joint_viscous_friction": [0.1] * joints,
        "nominal_pose": [0.0, 0.6, *[0.8 / joints] * (joints - 2)],
    }
    reach = length * (joints - 1)
    settings = {
        "arm": arm,
        "elbows": 0,
        "circle": {"center": [0.3 * reach, 0.5 * reach, 0.3 * reach], "radius": 0.05 * reach},
    }
    seen = viewer(**settings)
    at = seen.renderer.camera.project(seen.scene().joints)
    assert (at > 0.0).all()
    assert (at < (640.0, 480.0)).all()
    assert np.ptp(at, axis=0).max() > 120.0
    assert around(near(seen.picture(), TRACE, 60), at[-1], 3)


def test_picture_looks_like_the_golden_one():
    golden = np.asarray(Image.open(GOLDEN / "picture.png")).astype(int)
    difference = np.abs(picture().astype(int) - golden).max(axis=-1)
    # Another version of the font or of the smoothing may shift an edge by a shade.
    assert difference.mean() < 1.0
    assert (difference > 48).mean() < 0.005


def test_words_come_back_after_somebody_quit_pygame():
    seen = viewer()
    before = seen.picture()
    pygame.quit()
    seen.renderer._instruments._texts.clear()
    np.testing.assert_array_equal(seen.picture(), before)


def test_text_is_dark_on_light():
    pixels = viewer().picture()
    assert near(pixels[:60], INK, 12).sum() > 100
    assert pixels[:60].mean() > 225.0

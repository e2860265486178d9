"""Figure-eights are Lissajous's, one's own points are passed exactly, and velocities are derivatives."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from elbow_gym import Circle, paper_arm
from elbow_gym.task.fourier_path import path_rate, points_path
from elbow_gym.task.reach import check_reachable
from tests.support.strategies import between

CORNERS = [(1.4, 1.4, 0.3), (1.6, 1.4, 0.4), (1.6, 1.6, 0.5), (1.4, 1.6, 0.4)]
# Points of a path [m].
clouds = st.integers(3, 12).flatmap(lambda m: st.lists(st.tuples(*[between(-2.0, 2.0)] * 3), min_size=m, max_size=m))


@given(clouds)
def test_path_of_points_passes_through_each_at_equal_steps(points):
    circle, m = Circle(shape=points), len(points)
    np.testing.assert_allclose(circle.position(2.0 * np.pi * np.arange(m) / m), points, rtol=0.0, atol=1e-12)
    assert circle.path.shape == (circle.path_rows, 3)
    np.testing.assert_allclose(circle.path[0], np.mean(points, axis=0), rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("m", [3, 4, 5, 8])
def test_points_of_a_circle_give_the_circle(m):
    circle = Circle(radius=0.3, plane="radial")
    points = circle.position(2.0 * np.pi * np.arange(m) / m)
    expected = np.zeros((1 + m // 2 * 2, 3))
    expected[:3] = circle.path
    np.testing.assert_allclose(points_path(points), expected, rtol=0.0, atol=1e-15)


def test_of_the_highest_wave_an_even_number_of_points_tells_the_cosine():
    # cos 2a at a = 0, 90, 180, 270 degrees is 1, -1, 1, -1.
    path = points_path([(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)])
    expected = np.zeros((5, 3))
    expected[3, 0] = 1.0
    np.testing.assert_allclose(path, expected, atol=1e-16)


def test_figure_eight_is_lissajous_and_starts_as_the_circle_does():
    eight, circle = (Circle(shape=shape, radius=0.2, plane="xz", center=(1.0, 0.5, 0.6)) for shape in SHAPES)
    angle = np.linspace(0.0, 7.0, 15)
    expected = np.stack([1.0 + 0.2 * np.cos(angle), np.full(15, 0.5), 0.6 + 0.1 * np.sin(2.0 * angle)], axis=1)
    np.testing.assert_allclose(eight.position(angle), expected, atol=1e-15)
    np.testing.assert_allclose(eight.position(0.0), circle.position(0.0), atol=1e-15)
    np.testing.assert_allclose(eight.velocity(0.0), circle.velocity(0.0), atol=1e-15)
    # It crosses its own centre, twice a turn.
    np.testing.assert_allclose(eight.position([np.pi / 2.0, 1.5 * np.pi]), [[1.0, 0.5, 0.6]] * 2, atol=1e-15)
    assert eight.path.shape == (eight.path_rows, 3) == (5, 3)


SHAPES = ("figure_eight", "circle")


@pytest.mark.parametrize("direction", ["counterclockwise", "clockwise"])
@pytest.mark.parametrize("shape", ["figure_eight", CORNERS, [*CORNERS, (1.3, 1.5, 0.2)]], ids=["eight", "four", "five"])
def test_velocity_is_the_derivative_of_position_on_any_path(shape, direction):
    circle = Circle(shape=shape, direction=direction, period=3.0)
    time, h = np.linspace(0.0, 3.0, 17), 1e-5
    ahead, behind = (circle.position(circle.angle(time + step, 0.7)) for step in (h, -h))
    np.testing.assert_allclose(circle.velocity(circle.angle(time, 0.7)), (ahead - behind) / (2.0 * h), atol=1e-8)


def test_a_paths_rate_is_that_of_its_waves():
    path = np.arange(15.0).reshape(5, 3)
    zero, cos1, sin1, cos2, sin2 = path
    np.testing.assert_array_equal(path_rate(path, 3.0), [zero * 0.0, 3.0 * sin1, -3.0 * cos1, 6.0 * sin2, -6.0 * cos2])


def test_clockwise_passes_the_points_backwards_from_the_first():
    circle = Circle(shape=CORNERS, direction="clockwise", period=4.0)
    passed = circle.position(circle.angle([0.0, 1.0, 2.0, 3.0], 0.0))
    np.testing.assert_allclose(passed, [CORNERS[0], *CORNERS[:0:-1]], atol=1e-15)


@pytest.mark.parametrize(
    ("entry", "rule"),
    [
        ("star", r"circle shape must be one of \('circle', 'figure_eight'\) or a list of points, got 'star'"),
        (3, "circle shape must be one of .* or a list of points, got 3"),
        (CORNERS[:2], "circle shape must have at least 3 points, got 2"),
        ([*CORNERS, (1.0, 2.0)], r"circle shape must have points of three finite numbers, got \(1.0, 2.0\)"),
        ([*CORNERS, (1.0, 2.0, math.inf)], r"circle shape must have points of .*, got \(1.0, 2.0, inf\)"),
        ([*CORNERS, (1.0, "up", 0.0)], r"circle shape must have points of .*, got \(1.0, 'up', 0.0\)"),
        ([*CORNERS, (0.0, -1e308, 0.0)], r"circle shape must have coordinates of at most 1e\+100 m, got 1e\+308"),
        ([*CORNERS, 7], "circle shape must have points of three finite numbers, got 7"),
    ],
)
def test_what_is_no_shape_is_refused_in_words(entry, rule):
    with pytest.raises(ValueError, match=f"^{rule}$"):
        Circle(shape=entry)


@pytest.mark.parametrize("change", [{"radius": (0.1, 0.2)}, {"plane": "random"}, {"center": ((1.0, 1.1), 1.0, 0.3)}])
def test_what_points_fix_may_not_be_random(change):
    (name,) = change
    with pytest.raises(
        ValueError, match=rf"^circle {name} must not be random where the shape is given by points, got "
    ):
        Circle(shape=CORNERS, **change)


def test_a_path_out_of_reach_says_which_point_and_by_how_much():
    check_reachable(paper_arm(), (), Circle(shape=CORNERS))
    # The eight's far end is 3 m away, the arm is 2.7 m long.
    with pytest.raises(
        ValueError, match=r"^path must lie within the hand's reach, .* \(3\.0, 0\.0, 0\.0\) 0\.3 m outside$"
    ):
        check_reachable(paper_arm(), (), Circle(shape="figure_eight", center=(2.8, 0.0, 0.0), radius=0.2))


def test_a_path_that_swings_out_of_reach_between_its_points_is_refused():
    # All points lie 2.69 m away; between them, on a chord turned outward by the interpolation, the path leaves 2.7 m.
    turn = np.radians([0.0, 60.0, 50.0, 10.0])
    points = np.stack([2.69 * np.cos(turn), 2.69 * np.sin(turn), np.zeros(4)], axis=1)
    with pytest.raises(ValueError, match=r"^path must lie within the hand's reach"):
        check_reachable(paper_arm(), (), Circle(shape=points.tolist()))

"""The camera is a pinhole: rays through the eye, and the nearest one that sees everything."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from elbow_gym.rendering.camera import ELEVATION, framing

FRAME = (30.0, 50.0, 500.0, 300.0)
POINTS = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.4], [1.0, 1.5, 0.1], [0.3, -0.2, 0.5]])


def clouds():
    return arrays(np.float64, (6, 3), elements=st.floats(-3.0, 3.0))


@given(clouds(), st.floats(-math.pi, math.pi))
def test_frame_holds_all_points_and_is_filled_one_way(points, azimuth):
    camera = framing(points, azimuth, FRAME)
    left, top, width, height = FRAME
    x, y = np.moveaxis(camera.project(points), -1, 0)
    assert (camera.depth(points) >= -1e-9).all()
    if np.ptp(points, axis=0).max() < 1e-3:
        return
    assert x.min() >= left - 1e-6
    assert x.max() <= left + width + 1e-6
    assert y.min() >= top - 1e-6
    assert y.max() <= top + height + 1e-6
    assert np.ptp(x) == pytest.approx(width, rel=1e-6) or np.ptp(y) == pytest.approx(height, rel=1e-6)


def test_straight_ahead_is_the_centre_of_the_frame():
    camera = framing(POINTS, 0.7, FRAME)
    np.testing.assert_allclose(camera.project(camera.eye + 2.0 * camera.axes[2]), (280.0, 200.0), atol=1e-9)


def test_pixels_are_similar_triangles():
    camera = framing(POINTS, 0.7, FRAME)
    right, up, into = camera.axes
    point = camera.eye + 4.0 * into + 0.5 * right - 0.25 * up
    np.testing.assert_allclose(
        camera.project(point) - camera.centre, camera.focal_length * np.array([0.125, 0.0625]), atol=1e-9
    )
    assert camera.depth(point) == pytest.approx(4.0)
    assert camera.scale(point) == pytest.approx(camera.focal_length / 4.0)


def test_axes_are_right_handed_level_and_look_down_at_the_scene():
    camera = framing(POINTS, 0.7, FRAME)
    np.testing.assert_allclose(camera.axes @ camera.axes.T, np.eye(3), atol=1e-12)
    right, up, into = camera.axes
    np.testing.assert_allclose(np.cross(right, up), -into, atol=1e-12)
    assert right[2] == 0.0
    assert into[2] == pytest.approx(-math.sin(ELEVATION))
    assert np.dot(into[:2], [math.cos(0.7), math.sin(0.7)]) == pytest.approx(-math.cos(ELEVATION))


def test_twice_the_pixels_is_the_same_picture():
    camera = framing(POINTS, 0.7, FRAME)
    np.testing.assert_allclose(camera.enlarged(2.0).project(POINTS), 2.0 * camera.project(POINTS), atol=1e-9)


def test_points_behind_the_camera_stay_finite():
    camera = framing(POINTS, 0.7, FRAME)
    assert np.isfinite(camera.project(camera.eye - camera.axes[2])).all()

"""The circle as the paper draws it, its JSON form, and its reach."""

import math

import numpy as np
import pytest

from elbow_gym import ArmParameters, Circle, LinkParameters, MotorParameters, paper_arm
from elbow_gym.task.circle import as_angle, as_circle
from elbow_gym.task.reach import check_reachable, extreme_points, reach_shortfall

CENTER = np.array([1.5, 1.5, 0.4])
OUTWARD = np.array([1.0, 1.0, 0.0]) / math.sqrt(2.0)
AXES = {
    "xy": ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
    "xz": ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
    "yz": ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]),
    "radial": (OUTWARD, [0.0, 0.0, 1.0]),
}


def at(circle, time, phase=0.0):
    return circle.position(circle.angle(time, phase))


def test_papers_circle_starts_at_its_x_side_and_turns_counterclockwise_seen_from_above():
    circle = Circle()
    expected = [(1.6, 1.5, 0.4), (1.5, 1.6, 0.4), (1.4, 1.5, 0.4), (1.5, 1.4, 0.4), (1.6, 1.5, 0.4)]
    np.testing.assert_allclose(at(circle, [0.0, 1.25, 2.5, 3.75, 5.0]), expected, atol=1e-15)


@pytest.mark.parametrize("direction", ["counterclockwise", "clockwise"])
@pytest.mark.parametrize("plane", AXES)
def test_angle_grows_from_the_planes_first_axis_to_its_second(plane, direction):
    circle = Circle(plane=plane, direction=direction, radius=0.2, period=4.0)
    first, second = np.array(AXES[plane])
    sign = 1.0 if direction == "counterclockwise" else -1.0
    np.testing.assert_allclose(at(circle, 0.0), CENTER + 0.2 * first, atol=1e-15)
    np.testing.assert_allclose(at(circle, 1.0), CENTER + sign * 0.2 * second, atol=1e-15)
    np.testing.assert_allclose(at(circle, 0.0, phase=math.pi / 2), CENTER + 0.2 * second, atol=1e-15)


@pytest.mark.parametrize("direction", ["counterclockwise", "clockwise"])
@pytest.mark.parametrize("plane", AXES)
def test_velocity_is_the_derivative_of_position(plane, direction):
    circle = Circle(plane=plane, direction=direction, center=(0.3, -1.2, 0.5), radius=0.15, period=3.0)
    time, h = np.linspace(0.0, 3.0, 17), 1e-5
    slope = (at(circle, time + h, 0.7) - at(circle, time - h, 0.7)) / (2.0 * h)
    np.testing.assert_allclose(circle.velocity(circle.angle(time, 0.7)), slope, atol=1e-9)


def test_path_holds_centre_cosine_and_sine_rows():
    angle = np.linspace(-3.0, 9.0, 7)
    rows = np.stack([np.ones(7), np.cos(angle), np.sin(angle)], axis=1)
    circle = Circle(plane="radial")
    np.testing.assert_allclose(circle.position(angle), rows @ circle.path, atol=1e-15)


def test_position_keeps_the_angles_shape():
    assert Circle().position(0.3).shape == (3,)
    assert Circle().position(np.zeros((4, 2))).shape == (4, 2, 3)


def test_radial_circle_about_the_yaw_axis_lies_in_the_xz_plane():
    circle = Circle(plane="radial", center=(0.0, 0.0, 1.0))
    np.testing.assert_allclose(circle.position(0.0), [0.1, 0.0, 1.0], atol=1e-15)


def test_dict_form_is_json_and_its_own_inverse():
    circle = Circle(center=(1.0, 1.2, 0.3), radius=0.2, period=2.0, plane="yz", phase="random", direction="clockwise")
    assert Circle.from_dict(circle.to_dict()) == circle
    assert circle.to_dict()["center"] == [1.0, 1.2, 0.3]
    assert as_circle(None) == as_circle({}) == as_circle(Circle()) == Circle()


@pytest.mark.parametrize(
    ("entry", "rule"),
    [
        ({"radius": 0.0}, "circle radius must be positive, got 0.0"),
        ({"radius": "big"}, "circle radius must be a number, got 'big'"),
        ({"period": -5.0}, "circle period must be positive, got -5.0"),
        ({"period": math.inf}, "circle period must be finite, got inf"),
        ({"center": (1.0, 2.0)}, r"circle center must have three coordinates, got \(1.0, 2.0\)"),
        ({"center": "abc"}, "circle center must have three coordinates, got 'abc'"),
        ({"center": (1.0, math.nan, 0.0)}, r"circle center must be finite, got \(1.0, nan, 0.0\)"),
        ({"center": ("far", 0.0, 0.0)}, r"circle center must .*, got .*'far'.*"),
        ({"center": (None, 0.0, 0.0)}, r"circle center must .*, got .*None.*"),
        ({"plane": "zx"}, r"circle plane must be one of .*, got 'zx'"),
        ({"direction": "left"}, "circle direction must be one of .*, got 'left'"),
        ({"phase": "late"}, "circle phase must be an angle in rad or \"random\", got 'late'"),
        ({"phase": math.nan}, "phase must be finite, got nan"),
        ({"phase": None}, "phase must be an angle in rad, got None"),
        ({"colour": 1.0}, "circle must have only the entries .*, got 'colour'"),
    ],
)
def test_wrong_entry_is_a_value_error_naming_argument_rule_and_value(entry, rule):
    with pytest.raises(ValueError, match=f"^{rule}$"):
        as_circle(entry)


def test_circle_of_another_type_is_refused_by_name():
    with pytest.raises(ValueError, match=r"^circle must be a dict of its fields or None, got 3.0$"):
        as_circle(3.0)


def test_center_may_be_an_array():
    assert Circle(center=CENTER) == Circle()


@pytest.mark.parametrize(("phase", "kept"), [(2000.0 * math.pi + 0.3, 0.3), (-1e3, -1e3), (1e3, 1e3)])
def test_whole_turns_are_taken_out_of_a_large_phase(phase, kept):
    assert as_angle("phase", phase) == pytest.approx(kept, abs=1e-12)


@pytest.mark.parametrize("value", [True, "random", math.inf])
def test_phase_must_be_a_finite_number(value):
    with pytest.raises(ValueError, match=f"^phase must .*, got {value!r}$"):
        as_angle("phase", value)


@pytest.mark.parametrize("phase", [-1e6, 1e12, 1e300])
def test_a_phase_of_any_size_puts_the_target_on_the_circle(phase):
    circle = Circle(phase=phase)
    assert np.linalg.norm(at(circle, 0.3, circle.phase) - CENTER) == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize(
    ("elbows", "point", "shortfall"),
    [
        # Nine links of 0.3 m reach 2.7 m. Elbows at joint 4 or 7 leave 0.6 or 1.5 m on the table, 2.1 or 1.2 m free.
        ((), (3.0, 0.0, 0.0), 0.3),
        ((), (0.0, 0.0, 1.5), -1.2),
        ((4,), (3.0, 0.0, 0.0), 0.3),
        ((4,), (0.0, 0.0, 2.5), 0.4),
        ((4, 7), (0.0, -3.0, 0.0), 0.3),
        ((4, 7), (0.3, 0.4, 1.3), 0.1),
        ((4, 7), (2.4, 0.0, 1.2), 0.3),
    ],
)
def test_reach_is_the_table_part_along_the_table_and_the_rest_from_its_end(elbows, point, shortfall):
    assert reach_shortfall(paper_arm(), elbows, point) == pytest.approx(shortfall, abs=1e-12)


def test_a_link_longer_than_the_others_together_leaves_a_hole_around_the_base():
    arm = ArmParameters(
        links=(LinkParameters(length=0.0), LinkParameters(length=1.0), LinkParameters(length=0.2)),
        motors=(MotorParameters(),) * 3,
        joint_viscous_friction=(0.5,) * 3,
        nominal_pose=(0.0, 0.5, 0.5),
    )
    points = [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 0.0, 0.9), (0.0, 1.5, 0.0)]
    np.testing.assert_allclose(reach_shortfall(arm, (), points), [0.8, 0.3, -0.1, 0.3], atol=1e-12)


def test_path_is_sampled_at_each_degree_and_45_times_a_wave_where_there_are_more_than_eight():
    assert len(extreme_points(Circle())) == 361
    # One array for all who ask.
    assert not extreme_points(Circle()).flags.writeable
    points = [(1.0 + 0.1 * math.cos(k), 1.0 + 0.1 * math.sin(k), 0.4) for k in range(40)]
    assert len(extreme_points(Circle(shape=points))) == 1 + 45 * 20


def test_unreachable_circle_says_which_point_and_by_how_much():
    # The farthest point is 5.1 m away, the arm is 2.7 m long.
    with pytest.raises(ValueError, match=r"^circle must lie within .* \(5\.1, 0\.0, 0\.0\) 2\.4 m outside$"):
        check_reachable(paper_arm(), (), Circle(center=(5.0, 0.0, 0.0)))


def test_elbows_bring_a_circle_above_them_out_of_reach():
    circle = Circle(center=(0.5, 0.0, 2.0))
    check_reachable(paper_arm(), (), circle)
    with pytest.raises(ValueError, match=r"2.0\) 0\.8 m outside"):
        check_reachable(paper_arm(), (4, 7), circle)


def test_a_tilted_plane_is_turned_about_the_line_at_the_axis_angle():
    # About the y axis by 45 degrees: the point at angle zero goes down from the x axis, the one on y stays.
    circle = Circle(center=(1.5, 1.5, 0.4), radius=0.1, tilt=math.pi / 4.0, tilt_axis=math.pi / 2.0)
    half = 0.1 / math.sqrt(2.0)
    expected = [(1.5 + half, 1.5, 0.4 - half), (1.5, 1.6, 0.4)]
    np.testing.assert_allclose(circle.position([0.0, math.pi / 2.0]), expected, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(circle.normal, (math.sqrt(0.5), 0.0, math.sqrt(0.5)), rtol=0.0, atol=1e-15)
    # Upright planes turn likewise; a tilt of zero leaves every bit.
    upright = Circle(plane="xz", tilt=0.3, tilt_axis=0.0)
    np.testing.assert_allclose(upright.normal, (0.0, -math.cos(0.3), -math.sin(0.3)), rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(Circle(tilt_axis=1.0).path, Circle().path)


def test_velocity_in_a_tilted_plane_is_across_its_normal_and_as_fast():
    circle = Circle(radius=0.15, period=3.0, tilt=0.6, tilt_axis=2.0, direction="clockwise")
    velocity = circle.velocity(np.linspace(0.0, 6.0, 20))
    np.testing.assert_allclose(velocity @ circle.normal, 0.0, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=1), 0.15 * 2.0 * math.pi / 3.0, rtol=1e-12)
    around = np.cross(circle.position(0.5) - np.array(circle.center), circle.velocity(0.5))
    assert around @ circle.normal < 0.0

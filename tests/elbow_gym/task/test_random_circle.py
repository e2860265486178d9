"""Random circles: drawn within their ranges, from the generator alone, and all of them within reach."""

import json
import math
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from elbow_gym import ArmParameters, Circle, LinkParameters, MotorParameters, paper_arm
from elbow_gym.task.circle import PLANES
from elbow_gym.task.ranges import ends
from elbow_gym.task.reach import check_reachable, extreme_points, reach_shortfall
from tests.support.strategies import between

EVERYTHING = {
    "center": [[1.2, 1.4], 1.3, [0.3, 0.6]],
    "radius": [0.05, 0.2],
    "period": [3.0, 6.0],
    "plane": "random",
    "direction": "random",
    "phase": "random",
}


def drawn(plain, count=200, seed=0):
    generator = np.random.default_rng(seed)
    return [Circle.from_dict(plain).draw(generator) for _ in range(count)]


def spread(low, high, values):
    """Whether values lie within a range and come near both its ends."""
    margin = 0.05 * (high - low)
    return low <= min(values) < low + margin and high - margin < max(values) <= high


def test_draws_fill_their_ranges():
    circles = drawn(EVERYTHING)
    assert spread(1.2, 1.4, [circle.center[0] for circle in circles])
    assert {circle.center[1] for circle in circles} == {1.3}
    assert spread(0.3, 0.6, [circle.center[2] for circle in circles])
    assert spread(0.05, 0.2, [circle.radius for circle in circles])
    assert spread(3.0, 6.0, [circle.period for circle in circles])
    assert spread(-math.pi, math.pi, [circle.phase for circle in circles])
    assert {circle.plane for circle in circles} == set(PLANES)
    assert {circle.direction for circle in circles} == {"counterclockwise", "clockwise"}
    assert not any(circle.random or circle.drawn for circle in circles)


def test_a_list_of_planes_gives_those_alone():
    assert {circle.plane for circle in drawn({"plane": ["xz", "radial"]})} == {"xz", "radial"}


def test_draws_depend_on_the_generator_alone():
    assert drawn(EVERYTHING, 5, seed=3) == drawn(EVERYTHING, 5, seed=3)
    assert drawn(EVERYTHING, 5, seed=3) != drawn(EVERYTHING, 5, seed=4)


def test_draws_come_in_the_documented_order_one_for_each_random_quantity():
    circle, generator = drawn(EVERYTHING, 1, seed=7)[0], np.random.default_rng(7)
    center = (generator.uniform(1.2, 1.4), 1.3, generator.uniform(0.3, 0.6))
    radius, period = generator.uniform(0.05, 0.2), generator.uniform(3.0, 6.0)
    plane = PLANES[generator.integers(4)]
    direction = ("counterclockwise", "clockwise")[generator.integers(2)]
    phase = generator.uniform(-np.pi, np.pi)
    assert circle == Circle(center=center, radius=radius, period=period, plane=plane, direction=direction, phase=phase)


def test_a_random_phase_alone_takes_one_draw_and_is_no_random_circle():
    circle, generator, alone = Circle(phase="random"), np.random.default_rng(5), np.random.default_rng(5)
    assert not circle.random
    assert circle.drawn == ("phase",)
    assert circle.draw(generator).phase == alone.uniform(-np.pi, np.pi)
    assert generator.bit_generator.state == alone.bit_generator.state


def test_a_fixed_circle_draws_nothing_and_stays_itself():
    circle, generator = Circle(radius=0.2), np.random.default_rng(5)
    assert circle.draw(generator) is circle
    assert generator.bit_generator.state == np.random.default_rng(5).bit_generator.state


@pytest.mark.parametrize("name", ["center", "radius", "period", "plane", "direction"])
def test_what_is_still_to_be_drawn_is_asked_for_by_name(name):
    circle = Circle.from_dict({name: EVERYTHING[name]})
    assert circle.random
    asked = "rate" if name in ("period", "direction") else "path"
    with pytest.raises(ValueError, match=rf"^circle {name} must be drawn first, got "):
        getattr(circle, asked)


@pytest.mark.parametrize(
    "plain",
    [
        {name: EVERYTHING[name]} for name in EVERYTHING
    ]
    + [
        EVERYTHING,
        {"plane": ["xy", "yz"]},
        {"shape": "figure_eight", "radius": [0.1, 0.3]},
        {"shape": [[1.0, 1.0, 0.3], [1.2, 1.0, 0.3], [1.1, 1.3, 0.5]], "period": [2.0, 3.0]},
    ],
)  # fmt: skip
def test_every_form_survives_json(plain):
    circle = Circle.from_dict(plain)
    written = json.loads(json.dumps(circle.to_dict()))
    assert Circle.from_dict(written) == circle
    assert {name: written[name] for name in plain} == plain
    assert set(written) == {field.name for field in fields(Circle)}


@pytest.mark.parametrize(
    ("entry", "rule"),
    [
        ({"radius": [0.2, 0.1]}, r"circle radius must be a number or \[low, high\] with low <= high, got \[0.2, 0.1\]"),
        ({"radius": [0.0, 0.1]}, "circle radius must be positive, got 0.0"),
        ({"radius": [0.1, 0.2, 0.3]}, r"circle radius must be a number, got \[0.1, 0.2, 0.3\]"),
        ({"period": [1.0, math.inf]}, "circle period must be finite, got inf"),
        ({"center": [[1.0, 2.0], "far", 0.0]}, r"circle center must be three numbers or pairs \[low, high\], got .*"),
        ({"center": [[1.0, math.nan], 0.0, 0.0]}, "circle center must be finite, got .*"),
        ({"center": [[2.0, 1.0], 0.0, 0.0]}, r"circle center must be .* with low <= high, got \[2.0, 1.0\]"),
        ({"center": [[1.0, 2.0, 3.0], 0.0, 0.0]}, r"circle center must be three numbers or pairs .*"),
        ({"plane": ["xy", "zx"]}, r"circle plane must be one of .* or \"random\", got \['xy', 'zx'\]"),
        ({"plane": ["random"]}, r"circle plane must be one of .*, got \['random'\]"),
        ({"plane": []}, r"circle plane must be one of .*, got \[\]"),
        ({"plane": 3}, "circle plane must be one of .*, got 3"),
        ({"direction": "any"}, "circle direction must be one of .* or \"random\", got 'any'"),
    ],
)
def test_a_wrong_range_is_a_value_error_naming_field_rule_and_value(entry, rule):
    with pytest.raises(ValueError, match=f"^{rule}$"):
        Circle.from_dict(entry)


def test_the_worst_circle_that_may_be_drawn_decides_whether_the_set_is_within_reach():
    # Farthest: centre (2.4, 0, 0) and radius 0.4, 0.1 m beyond the arm's 2.7 m.
    plain = {"center": [[1.0, 2.4], 0.0, 0.0], "radius": [0.1, 0.29]}
    check_reachable(paper_arm(), (), Circle.from_dict(plain))
    plain["radius"] = [0.1, 0.4]
    with pytest.raises(ValueError, match=r"^circle must lie within .* \(2\.8, 0\.0, 0\.0\) 0\.1 m outside$"):
        check_reachable(paper_arm(), (), Circle.from_dict(plain))
    with pytest.raises(ValueError, match=r"^path must lie within .* \(2\.8, 0\.0, 0\.0\) 0\.1 m outside$"):
        check_reachable(paper_arm(), (), Circle.from_dict(plain | {"shape": "figure_eight"}))


def test_every_plane_that_may_be_drawn_counts():
    # Upright, the circle rises to 2.75 m above the base; flat, it stays at 2.5 m.
    plain = {"center": [0.0, 0.0, [0.5, 2.5]], "radius": 0.25}
    check_reachable(paper_arm(), (), Circle.from_dict(plain | {"plane": ["xy"]}))
    with pytest.raises(ValueError, match=r"0\.05 m outside$"):
        check_reachable(paper_arm(), (), Circle.from_dict(plain | {"plane": "random"}))


@st.composite
def random_circles(draw):
    def pair(low, high):
        return sorted((draw(between(low, high)), draw(between(low, high))))

    return Circle(
        center=[pair(-3.0, 3.0) for _ in range(3)],
        radius=pair(0.05, 1.5),
        plane=draw(st.sampled_from([*PLANES, "random"])),
        shape=draw(st.sampled_from(["circle", "figure_eight"])),
    )


def arm_with_a_hole():
    return ArmParameters(
        links=(LinkParameters(length=0.0), LinkParameters(length=2.5), LinkParameters(length=1.5)),
        motors=(MotorParameters(),) * 3,
        joint_viscous_friction=(0.5,) * 3,
        nominal_pose=(0.0, 0.5, 0.5),
    )


@given(random_circles(), st.sampled_from([(), (4,), (4, 7)]), st.integers(0, 2**32))
def test_no_circle_of_an_accepted_set_is_out_of_reach_by_more_than_the_set_was_found_to_be(circle, elbows, seed):
    generator, angle = np.random.default_rng(seed), np.linspace(0.0, 2.0 * np.pi, 91)
    for arm, joints in ((paper_arm(), elbows), (arm_with_a_hole(), ())):
        worst = max(reach_shortfall(arm, joints, circle.draw(generator).position(angle)).max() for _ in range(10))
        if worst > 0.0:
            with pytest.raises(ValueError, match=r"must lie within the hand's reach") as error:
                check_reachable(arm, joints, circle)
            found = float(str(error.value).split()[-3])
            # Printed with four digits; the angles are a degree apart.
            assert found > worst - 1e-3 * (1.0 + worst)


def test_the_widest_circle_is_fixed_and_the_largest_that_may_be_drawn():
    widest = Circle.from_dict(EVERYTHING).widest
    assert not widest.drawn
    assert widest.center == pytest.approx((1.3, 1.3, 0.45))
    assert (widest.period, widest.phase, widest.direction) == (4.5, 0.0, "counterclockwise")
    assert widest.radius == max(circle.radius for circle in [widest, *drawn(EVERYTHING)])
    assert Circle(radius=0.2).widest == Circle(radius=0.2)


TILTED = {"radius": [0.05, 0.2], "tilt": [0.1, 0.7], "tilt_axis": "random", "phase": "random"}


def test_tilts_are_drawn_behind_the_plane_and_before_the_direction():
    generator = np.random.default_rng(7)
    circle = Circle.from_dict({**TILTED, "direction": "random"}).draw(np.random.default_rng(7))
    radius, tilt, axis = generator.uniform(0.05, 0.2), generator.uniform(0.1, 0.7), generator.uniform(-np.pi, np.pi)
    direction = ("counterclockwise", "clockwise")[generator.integers(2)]
    phase = generator.uniform(-np.pi, np.pi)
    assert circle == Circle(radius=radius, tilt=tilt, tilt_axis=axis, direction=direction, phase=phase)


@pytest.mark.parametrize(
    "ranges",
    [TILTED, {**TILTED, "plane": "radial"}, {"tilt": [-0.4, 1.5], "tilt_axis": 0.7}, {"tilt_axis": "random"}],
    ids=["any axis", "radial", "one axis", "no tilt"],
)
def test_no_tilted_circle_that_may_be_drawn_leaves_the_hull_of_the_extreme_points(ranges):
    extremes = extreme_points(Circle.from_dict(ranges))
    points = np.concatenate([circle.position(np.linspace(0.0, 6.3, 50)) for circle in drawn(ranges, 100)])
    directions = np.random.default_rng(1).normal(size=(60, 3))
    assert ((extremes @ directions.T).max(axis=0) >= (points @ directions.T).max(axis=0) - 1e-4).all()
    # Nor is a circle refused that is farther from the drawn ones than 2 % of the radius: the last point is a hole's.
    largest = ends(Circle.from_dict(ranges).radius)[-1]
    assert np.linalg.norm(extremes[:-1] - np.array([1.5, 1.5, 0.4]), axis=1).max() <= 1.02 * largest

"""The circle of an arm that was given none: the paper's where it can be followed, else one that can."""

import json
from math import pi

import gymnasium as gym
import numpy as np
import pytest

from elbow_gym import ArmParameters, LinkParameters, MotorParameters, paper_arm
from elbow_gym.kinematics import inverse_kinematics
from elbow_gym.task.circle import Circle
from elbow_gym.task.default_circle import default_circle
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv
from tests.support.arms import six_joint_arm


def arm_of(lengths, pose):
    return ArmParameters(
        links=(LinkParameters(length=0.0), *(LinkParameters(length=length) for length in lengths)),
        motors=(MotorParameters(),) * (len(lengths) + 1),
        joint_viscous_friction=(0.5,) * (len(lengths) + 1),
        nominal_pose=pose,
    )


SIX = six_joint_arm()


@pytest.mark.parametrize("elbows", [(), (4,), (4, 7)])
def test_papers_arm_has_the_papers_circle(elbows):
    assert default_circle(paper_arm(), elbows) == Circle()


@pytest.mark.parametrize(
    ("arm", "elbows"),
    [
        (SIX, (4,)),
        (SIX, ()),
        (arm_of((0.3, 0.2), (0.0, 0.3, 1.0)), ()),
        (arm_of((0.05, 0.04, 0.03, 0.06), (0.0, 0.2, 0.6, 0.5, 0.8)), ()),
        (arm_of((0.5, 0.5, 0.5, 0.2, 0.5), (0.0, 0.9, 1.3, -1.0, 0.1, 0.4)), (4,)),
    ],
)
def test_circle_of_another_arm_is_above_the_table_and_followed_by_the_last_two_links(arm, elbows):
    circle = default_circle(arm, elbows)
    assert circle != Circle()
    point = circle.position(np.linspace(0.0, 2.0 * pi, 200))
    env = ElbowArmVectorEnv(1, arm=arm, elbows=elbows)
    q, _ = inverse_kinematics(arm, env.episodes.pose, point)
    assert np.isfinite(q).all()
    assert point[:, 2].min() > 0.0
    assert np.hypot(point[:, 0], point[:, 1]).min() > 0.0
    assert env.settings.parsed_circle == circle


def test_arm_that_no_circle_suits_is_refused_for_the_papers():
    # The last two links hang far below the table.
    with pytest.raises(ValueError, match=r"^circle must lie within the hand's reach"):
        Settings(arm=arm_of((1.0, 0.1, 0.1), (0.0, pi, 0.1, 0.1)), elbows=0)


def test_given_circle_is_kept():
    circle = {"center": [0.9, 0.9, 0.4]}
    assert Settings(arm=SIX, elbows=(4,), circle=circle).parsed_circle == Circle(center=(0.9, 0.9, 0.4))


def test_arm_is_read_from_a_file_once(tmp_path):
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(SIX.to_dict()))
    env = gym.make("ElbowArm-v0", arm=str(path), elbows=(4,))
    path.unlink()
    assert env.unwrapped.settings.parsed_arm == SIX
    assert env.unwrapped.settings.arguments["arm"] == SIX.to_dict()


@pytest.mark.parametrize(
    ("content", "reason"),
    [(None, "No such file"), ("{", "Expecting"), ('{"links": []}', "arm must have the entry"), ("[1]", "arm must be")],
)
def test_wrong_arm_file_is_named_with_what_is_wrong(tmp_path, content, reason):
    path = tmp_path / "mine.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(ValueError, match=rf"^arm must be a JSON file of an arm, got {path}: .*{reason}"):
        Settings(arm=str(path))

"""Tasks of the suite as settings: the same episodes as by reset options, and all of the box within the arm's means."""

import itertools
import math
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

import elbow_gym
from agents.control.inverse_dynamics import InverseDynamics
from agents.control.posture import best_postures, leads_to
from agents.tasks import settings_of_task, task_settings
from elbow_gym import Circle, ElbowArmEnv, evaluation_tasks, paper_arm
from elbow_gym.kinematics import inverse_kinematics, joint_positions
from elbow_gym.suite import ENV
from elbow_gym.task.ranges import ends

ARM = paper_arm()
BOX = Circle(**elbow_gym.TASKS["circle"])
SUPPLY = 23.0
"""Voltage that is enough [V], one less than the supply has."""
each_count = pytest.mark.parametrize("elbows", [2, 1, 0])


@each_count
def test_settings_of_a_task_give_the_episode_of_its_reset_options(elbows):
    task = evaluation_tasks(elbows)[3]
    env, alone = gym.make(ENV, elbows=elbows), ElbowArmEnv(**settings_of_task(elbows, task).arguments)
    (_, told), (_, ours) = env.reset(options=task), alone.reset(seed=0)
    assert ours["tracking_error"] == pytest.approx(told["tracking_error"], rel=1e-12)
    for action in np.random.default_rng(0).uniform(-1.0, 1.0, (20, 10)).astype(np.float32):
        reward, expected = alone.step(action)[1], env.step(action)[1]
    # The start pose is put on the table again, which may round its last bits.
    assert reward == pytest.approx(expected, rel=1e-9)


def means(elbows, circle, payload, start=ARM.nominal_pose):
    """What a circle takes from a posture: largest voltage [V], least bend of the last joint [rad], lowest joint [m].

    Joints 1, n-1 and n alone follow the circle from a posture of the others, to which the straight way from the start
    pose leads with the elbows down: the first that the searches find within the supply, or else the last.
    """
    joints = task_settings("ElbowArm-v0", elbows).elbow_joints
    # The postures are for eight points; their polygon around a larger circle has the whole circle inside.
    around = replace(circle, radius=circle.radius / math.cos(math.pi / 8.0))
    arm = replace(ARM, nominal_pose=tuple(start))
    for starts, seed in ((3, 0), (8, 1), (8, 2)):
        found = best_postures(ARM, joints, around, starts=starts, seed=seed, payload=payload)
        taken = min(moving(joints, circle, payload, one.pose) for one in found if leads_to(arm, joints, one.pose))
        if taken[0] < SUPPLY:
            break
    return taken


def moving(joints, circle, payload, pose):
    angle = np.linspace(0.0, 2.0 * np.pi, 181) * np.sign(circle.rate)
    time = np.abs(angle / circle.rate)
    q, q_dot = inverse_kinematics(ARM, pose, circle.position(angle), circle.velocity(angle))
    inverse = InverseDynamics(ARM, joints, payload)
    current = inverse.drive(q, q_dot, np.gradient(q_dot, time, axis=0)).current
    voltage = inverse.voltage(q_dot, current, np.gradient(current, time, axis=0))
    return np.abs(voltage).max(), q[:, -1].min(), joint_positions(ARM, q)[:, 2:, 2].min()


def check(found):
    volts, bend, height = np.array(found).T
    assert volts.max() < SUPPLY
    assert bend.min() > 0.2
    assert height.min() > -1e-3


@pytest.mark.slow
@pytest.mark.soak
@each_count
def test_every_corner_of_the_box_can_be_followed_from_one_posture_within_the_supply(elbows):
    payload = task_settings(ENV, elbows).randomization.highest("payload")
    tilts = [(0.0, 0.0), *((BOX.tilt[1], axis) for axis in np.arange(8) * math.pi / 4.0)]
    found = [
        means(
            elbows,
            Circle(center=center, radius=BOX.radius[1], period=BOX.period[0], tilt=tilt, tilt_axis=axis),
            payload,
        )
        for center in itertools.product(*map(ends, BOX.center))
        for tilt, axis in tilts
    ]
    check(found)


@pytest.mark.slow
@pytest.mark.soak
@each_count
def test_every_evaluation_task_can_be_followed_from_a_posture_that_its_start_leads_to(elbows):
    found = [
        means(elbows, Circle(**task["circle"]), task["parameters"]["payload"], task["state"]["q"])
        for task in evaluation_tasks(elbows)
    ]
    check(found)


def test_a_heavier_payload_would_be_too_much_without_an_elbow():
    volts = means(0, Circle(center=(1.65, 1.65, 0.55), radius=0.15, period=3.0), 0.3)[0]
    assert 30.0 < volts < 36.0

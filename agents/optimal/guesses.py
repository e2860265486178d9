"""Guesses that a search starts from: smooth motions to postures, and what the simulator makes of a plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.lqr import TimeVaryingLQR
from agents.control.minimum_jerk import minimum_jerk
from agents.control.posture import best_postures
from agents.control.trajectory import Trajectory
from agents.evaluation.recording import Recording, record
from agents.optimal.problem import Problem
from elbow_gym.kinematics import inverse_kinematics, nearest_turn, on_table
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

Array = NDArray[np.float64]

SEARCHES = 12
"""Least number of searches for postures of least copper loss."""
ALIKE = 0.2
"""Largest difference of an angle up to which two postures are one [rad]."""
NOISE = 0.5
"""Standard deviation of a random posture's idle joints [rad]."""
TRIES = 100
"""Random poses that are tried for each guess, at most."""
REACH_TIME = 1.0
"""Time of a guess from the start to its posture [s]."""


def posture_guesses(problem: Problem, count: int = 2) -> dict[str, Trajectory]:
    """Smooth motions from the start to postures, by name.

    They are the paper's posture, those of least copper loss at rest, the best first, and then the paper's with normal
    noise on its idle joints, always the same. Postures from which the last two links do not cover the path are left
    out, so that there may be fewer than `count`.
    """
    settings = problem.settings
    arm, circle, elbows = settings.parsed_arm, settings.parsed_circle, settings.elbow_joints
    nominal = np.array(arm.nominal_pose)
    poses = {"paper posture": nominal}
    try:
        found = best_postures(
            arm, elbows, circle, problem.above_table, starts=max(SEARCHES, count), payload=settings.payload
        )
    except ValueError:
        # Where no posture serves the whole path at rest, one in motion may.
        found = []
    for posture in found:
        apart = min(float(np.abs(posture.pose - pose).max()) for pose in poses.values())
        if len(poses) < count and (apart > ALIKE or len(poses) == 1):
            poses[f"posture of {posture.copper_loss:.1f} W"] = posture.pose
    guesses = {name: guess for name, pose in poses.items() if (guess := _motion(problem, pose)) is not None}
    rng = np.random.default_rng(0)
    for k in range(TRIES * count):
        if len(guesses) >= count or count <= 2:
            break
        noise = np.concatenate([[0.0], rng.normal(scale=NOISE, size=arm.n_joints - 3), [0.0, 0.0]])
        try:
            guess = _motion(problem, on_table(arm, nominal + noise, elbows))
        except ValueError:
            continue
        if guess is not None:
            guesses[f"random posture {k + 1}"] = guess
    return guesses


def _motion(problem: Problem, pose: Array) -> Trajectory | None:
    """The smooth motion to a posture [rad], (n,), without voltages; None where the path is out of its reach."""
    settings, circle = problem.settings, problem.settings.parsed_circle
    instants = settings.control_period * np.arange(settings.horizon + 1)
    angle = circle.angle(instants, float(circle.phase))
    grown, rate, _ = minimum_jerk(instants / REACH_TIME)
    try:
        q_d, q_d_dot = inverse_kinematics(settings.parsed_arm, pose, circle.position(angle), circle.velocity(angle))
    except ValueError:
        return None
    # Each from the one before it: taken one by one, joints 1 and n-1 may come with another turn.
    before = problem.start
    for k, wanted in enumerate(q_d):
        q_d[k] = before = nearest_turn(wanted, before)
    q = problem.start + grown[:, None] * (q_d - problem.start)
    q_dot = rate[:, None] / REACH_TIME * (q_d - problem.start) + grown[:, None] * q_d_dot
    return Trajectory(q, q_dot, np.zeros_like(q), np.zeros_like(q[1:]))


def simulated(problem: Problem, trajectory: Trajectory) -> tuple[Trajectory, Recording]:
    """States and voltages of the simulator under the LQR around a trajectory, without noise, and the recording."""
    _, recording = rollout(problem.settings, lambda env: TimeVaryingLQR(env, trajectory))
    states = (recording.q[:, 0], recording.q_dot[:, 0], recording.current[:, 0])
    return Trajectory(*states, recording.voltage[1:, 0]), recording


def rollout(settings: Settings, make_controller: Callable[[ElbowArmVectorEnv], Any]) -> tuple[float, Recording]:
    """Negative return and recording of one episode from the start without noise."""
    recording = record(replace(settings, start_noise=0.0), make_controller, [0])
    return cost_of(recording), recording


def cost_of(recording: Recording) -> float:
    """Negative return of the first recorded episode, at its environment's own control rate."""
    settings = recording.settings
    error = np.linalg.norm(recording.hand - recording.target, axis=-1)[1:, 0]
    energy = recording.electrical_energy[-1, 0].sum()
    return float(settings.tracking_weight * error.sum() + settings.energy_weight * energy / settings.control_period)

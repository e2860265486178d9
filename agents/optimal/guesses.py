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
from elbow_gym.kinematics import inverse_kinematics
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

Array = NDArray[np.float64]

REACH_TIME = 1.0
"""Time of a guess from the start to its posture [s]."""


def posture_guesses(problem: Problem) -> dict[str, Trajectory]:
    """Smooth motions from the start to the paper's posture and to the best posture at rest, by name."""
    settings = problem.settings
    arm, circle, elbows = settings.parsed_arm, settings.parsed_circle, settings.elbow_joints
    poses = {"paper posture": np.array(arm.nominal_pose)}
    try:
        best = best_postures(arm, elbows, circle, problem.above_table, payload=settings.payload)[0]
        poses[f"posture of {best.copper_loss:.1f} W"] = best.pose
    except ValueError:
        # Where no posture serves the whole path at rest, one in motion may.
        pass
    instants = settings.control_period * np.arange(settings.horizon + 1)
    angle = circle.angle(instants, float(circle.phase))
    grown, rate, _ = minimum_jerk(instants / REACH_TIME)
    guesses = {}
    for name, pose in poses.items():
        try:
            q_d, q_d_dot = inverse_kinematics(arm, pose, circle.position(angle), circle.velocity(angle))
        except ValueError:
            # The last two links do not cover the path from this posture; another one may.
            continue
        q = problem.start + grown[:, None] * (q_d - problem.start)
        q_dot = rate[:, None] / REACH_TIME * (q_d - problem.start) + grown[:, None] * q_d_dot
        guesses[name] = Trajectory(q, q_dot, np.zeros_like(q), np.zeros_like(q[1:]))
    return guesses


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

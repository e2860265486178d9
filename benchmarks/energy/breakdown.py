"""The paper PD's energy in parts: the step at the start, the sag, the posture, and what is left, joint by joint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.control.classical import economical_pose
from agents.control.inverse_dynamics import InverseDynamics
from agents.files import write_csv, write_text
from agents.style import ELBOW_NAMES
from benchmarks.energy import cache
from elbow_gym.kinematics import inverse_kinematics
from elbow_gym.task.settings import Settings

Array = NDArray[np.float64]

POINTS = 2001
PARTS = ("start step", "sag", "posture", "least")


class Share(NamedTuple):
    """Energy by joint [J], (n,): the four parts sum to the whole of regime A."""

    elbows: int
    whole: Array
    start_step: Array
    """Energy of the step from the paper's pose [J], (n,): regime A minus regime C."""
    sag: Array
    """Energy of the PD's error and its start [J], (n,): regime C minus the exact motion in the paper's posture."""
    posture: Array
    """Energy of the posture [J], (n,): the exact motion in the paper's minus that in the one of least copper loss."""
    least: Array
    """Energy of the exact motion in the posture of least copper loss at rest [J], (n,)."""


class Motions(NamedTuple):
    """Energy by joint [J], (n,), of exact motions on the target."""

    papers: Array
    """Energy by joint with the idle joints in the paper's posture [J], (n,)."""
    least: Array
    """Energy by joint with the idle joints in the posture of least copper loss at rest [J], (n,)."""


def exact_energy(settings: Settings, pose: ArrayLike) -> Array:
    """Electrical energy by joint [J], (n,), of moving on the target without error, idle joints as in `pose` [rad].

    The voltages and currents are those of inverse dynamics with the elbow forces of least copper loss.
    """
    arm, circle = settings.parsed_arm, settings.parsed_circle
    inverse = InverseDynamics(arm, settings.elbow_joints)
    time = np.linspace(0.0, settings.duration, POINTS)
    angle = circle.angle(time, float(circle.phase))
    q, q_dot = inverse_kinematics(arm, pose, circle.position(angle), circle.velocity(angle))
    current = inverse.drive(q, q_dot, np.gradient(q_dot, time, axis=0)).current
    voltage = inverse.voltage(q_dot, current, np.gradient(current, time, axis=0))
    return np.trapezoid(voltage * current, time, axis=0)


def exact_motions(elbows: int) -> Motions:
    """The exact motions of an elbow count in both postures."""
    settings = Settings(elbows=elbows)
    arm = settings.parsed_arm
    best = economical_pose(arm, settings.elbow_joints, settings.parsed_circle)
    return Motions(*(exact_energy(settings, pose) for pose in (arm.nominal_pose, best)))


def stored_motions(folder: Path, elbows: int) -> Motions:
    """`exact_motions`, kept in a folder: the search for the posture takes a second."""
    key = cache.key({"motions": elbows, "code": Path(__file__).read_text(encoding="utf-8")})
    stored = cache.load(key, folder)
    if stored is None:
        stored = {"exact": exact_motions(elbows)._asdict()}
        cache.store(key, stored, folder)
    return Motions(**stored["exact"])


def breakdown(
    joint_energy: Callable[[int, str], Sequence[float]],
    elbow_counts: Sequence[int],
    motions: Callable[[int], Motions] = exact_motions,
) -> list[Share]:
    """The shares for each elbow count.

    Args:
        joint_energy: the paper PD's energy by joint [J] at an elbow count in a regime.
        elbow_counts: in the order of the shares.
        motions: gives the exact motions at an elbow count.
    """
    shares = []
    for elbows in elbow_counts:
        papers, least = motions(elbows)
        whole, on_target = (np.array(joint_energy(elbows, regime)) for regime in ("A", "C"))
        shares.append(Share(elbows, whole, whole - on_target, on_target - papers, papers - least, least))
    return shares


def markdown(shares: Sequence[Share]) -> str:
    """One row per elbow count and part, one column per joint [J]."""
    joints = len(shares[0].whole)
    header = ("elbows", "part", "sum", *(f"joint {k}" for k in range(1, joints + 1)))
    lines = [header, ("---",) * len(header)]
    for share in shares:
        for name, part in zip(("whole", *PARTS), share[1:], strict=True):
            lines.append((ELBOW_NAMES[share.elbows], name, f"{part.sum():.1f}", *(f"{value:.1f}" for value in part)))
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def save(shares: Sequence[Share], folder: Path) -> None:
    """Writes breakdown.csv and breakdown.md."""
    joints = len(shares[0].whole)
    header = ["elbows", "part", "sum [J]", *(f"joint_{k} [J]" for k in range(1, joints + 1))]
    rows = [
        [share.elbows, name, f"{part.sum():.6g}", *(f"{value:.6g}" for value in part)]
        for share in shares
        for name, part in zip(("whole", *PARTS), share[1:], strict=True)
    ]
    write_csv(folder / "breakdown.csv", header, rows)
    write_text(folder / "breakdown.md", markdown(shares))

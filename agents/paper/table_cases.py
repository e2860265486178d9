"""The paper's PD on a table that gives way and cannot pull, from three start poses: runs and their numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from agents.evaluation.metrics import metrics
from agents.evaluation.recording import Array, Recording, instant
from agents.paper.cases import RECORD_PERIOD
from agents.paper.figures import SETTLED
from agents.paper.subject import Subject
from agents.style import joints_in_words
from elbow_gym.baselines.pd import PAPER_KD, PAPER_KP
from elbow_gym.kinematics import hand_position, inverse_kinematics, nearest_turn, radii
from elbow_gym.parameters import ArmParameters
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulator import Simulator
from elbow_gym.task.settings import Settings

FRICTIONS = (0.0, 0.1, 0.3)
"""Coulomb's coefficient of the table [-]."""

LIFT = 1.0 / 3.0
"""Height by which a joint that does not lean is above the one before it, over the mean length of the links [-].

The PD has no gravity compensation: as the paper's arm, whose links are 0.3 m long, swings over at the start, joint 7
sags by 0.07 m where joint 4 leans and by up to 0.2 m where nothing does.
"""
CLEAR = "clear"
"""Name of the start from which nothing leans on the table."""


def lifts(subject: Subject) -> dict[str, tuple[float, ...]]:
    """Heights of the elbows in the start poses [m], by what then touches the table, most joints first."""
    joints, lift = subject.elbow_joints, LIFT * float(subject.arm.of_links("length")[1:].mean())
    found = {}
    for leaning in subject.cases:
        name = joints_in_words(joints[:leaning]) if leaning else CLEAR
        found[name] = tuple(lift * max(0, number - leaning) for number in range(1, len(joints) + 1))
    return found


@dataclass(frozen=True)
class TableRecording(Recording):
    """A run on the compliant table; its arms are side by side, one per start."""

    normal_force: Array
    """Normal force of the table on joints 3..n and, last, the hand [N], (T + 1, B, n - 1); never negative."""
    contact_loss: Array
    """Heat in all contacts since the start [J], (T + 1, B)."""


@dataclass(frozen=True, kw_only=True)
class TableNumbers:
    """Energies, errors and upward forces of the table for one start and one friction, under the paper's PD."""

    energy: float
    """Signed electrical energy of the whole run [J]."""
    energy_tracking: float
    """Signed electrical energy from t = 2 s on [J]."""
    copper_loss_tracking: float
    """Heat in the windings from t = 2 s on [J]."""
    contact_loss: float
    """Heat in the contacts over the whole run [J]."""
    contact_loss_tracking: float
    """Heat in the contacts from t = 2 s on [J]."""
    error_rms: float
    """Root mean square of the hand's error from t = 2 s on [mm]."""
    z_rms: float
    """Root mean square of the error's vertical part from t = 2 s on [mm]."""
    force: Mapping[int, Force]
    """Force on each joint that may lean, from t = 2 s on [N], by its number."""
    force_elsewhere_largest: float
    """Largest force on any other joint or the hand over the whole run [N], as the arm swings over at the start."""

    @property
    def columns(self) -> dict[str, float]:
        """All numbers by name, those of the forces as in force_4_mean."""
        plain = asdict(self)
        elsewhere, forces = plain.pop("force_elsewhere_largest"), plain.pop("force")
        named = {f"force_{joint}_{name}": value for joint, one in forces.items() for name, value in one.items()}
        return {**plain, **named, "force_elsewhere_largest": elsewhere}


@dataclass(frozen=True)
class Force:
    """Force of the table on a joint over a time."""

    mean: float
    """Mean force [N]."""
    smallest: float
    """Smallest force [N]."""
    largest: float
    """Largest force [N]."""


def start_pose(arm: ArmParameters, elbows: Sequence[int], lift: Sequence[float]) -> Array:
    """The nominal pose with the elbows at the heights `lift` [m] and the hand where it was [rad], (n,).

    The elbows are on the table in the nominal pose. The links between two of them, or before the first, turn as one
    piece, and the links after the last keep their direction but for the last two, which put the hand back; where it is
    out of their reach they keep it too. Raises ValueError where elbows are not far enough apart.
    """
    pose = np.array(arm.nominal_pose)
    rise, run = np.diff(lift, prepend=0.0), np.diff(radii(arm, pose, elbows), prepend=0.0)
    if not (np.abs(rise) < np.abs(run)).all():
        raise ValueError(f"elbows must be {np.abs(rise).max():.3g} m apart to be lifted, got {np.abs(run).min():.3g} m")
    turn = np.arcsin(rise / run)
    pose[[1, *(elbow - 1 for elbow in elbows)]] += np.diff(np.append(-turn, 0.0), prepend=0.0)
    try:
        return inverse_kinematics(arm, pose, hand_position(arm, np.array(arm.nominal_pose)))[0]
    # Out of the last two links' reach.
    except ValueError:
        return pose


def play_on_table(
    poses: Sequence[Array],
    table: Mapping[str, float],
    settings: Settings,
    progress: Callable[[int], Any] | None = None,
) -> TableRecording:
    """One run of the paper's PD per start pose, side by side, on the compliant table with no rigid elbow.

    Args:
        poses: start poses [rad], (n,) each, which the PD keeps on its idle joints.
        table: fields of `TableParameters`.
        settings: circle, control frequency and duration; voltages are not limited.
        progress: called with the control periods done since its last call.

    Raises:
        ArithmeticError: the simulation left what float64 can represent.
    """
    arm, circle, period = settings.parsed_arm, settings.parsed_circle, settings.control_period
    steps = replace(settings, table=table).substeps
    simulator = Simulator(arm, 0, len(poses), conditions=Conditions(table=table), timestep=float(steps.min()))
    time = np.arange(settings.horizon + 1) * period
    angle = circle.angle(time, 0.0)
    target, velocity = circle.position(angle), circle.velocity(angle)
    desired = [inverse_kinematics(arm, pose, target, velocity) for pose in poses]
    q_d, q_d_dot = (np.stack(series, axis=1) for series in zip(*desired, strict=True))
    simulator.reset(np.stack(poses))
    every = max(1, round(RECORD_PERIOD / period))
    kept: list[dict[str, Array]] = []
    largest = np.zeros_like(simulator.q)
    for k in range(settings.horizon + 1):
        if k % every == 0:
            kept.append({**_instant(simulator), "voltage": largest})
            largest = np.zeros_like(largest)
        if k < settings.horizon:
            wanted = nearest_turn(q_d[k], simulator.q)
            voltage = PAPER_KP * (wanted - simulator.q) + PAPER_KD * (q_d_dot[k] - simulator.q_dot)
            largest = np.where(np.abs(voltage) > np.abs(largest), voltage, largest)
            simulator.advance(voltage, steps)
            if not simulator.valid.all():
                raise ArithmeticError(f"the simulation left what float64 can represent at {time[k]:g} s")
        if progress is not None and k and k % 500 == 0:
            progress(500)
    series = {name: np.stack([values[name] for values in kept]) for name in kept[0]}
    shown = np.repeat(target[::every, None], len(poses), axis=1)
    return TableRecording(settings, (0,) * len(poses), time[::every], target=shown, **series)


def _instant(simulator: Simulator) -> dict[str, Array]:
    forces = simulator.contact_force[..., 2]
    return {
        **{name: view.copy() for name, view in instant(simulator).items()},
        "normal_force": forces,
        "contact_loss": simulator.contact_loss.sum(axis=1),
    }


def measure_on_table(run: TableRecording, elbows: Sequence[int]) -> list[TableNumbers]:
    """Numbers of each arm of a run, whose joints `elbows` may lean on the table."""
    whole, late = metrics(run), metrics(run, SETTLED)
    settled = np.searchsorted(run.time, SETTLED - 1e-9)
    # The first contact is joint 3's.
    force = {joint: run.normal_force[settled:, :, joint - 3] for joint in elbows}
    elsewhere = np.delete(run.normal_force, [joint - 3 for joint in elbows], axis=2).max(axis=(0, 2))
    values = {
        "energy": whole["electrical_energy"],
        "energy_tracking": late["electrical_energy"],
        "copper_loss_tracking": late["copper_loss"],
        "contact_loss": run.contact_loss[-1],
        "contact_loss_tracking": run.contact_loss[-1] - run.contact_loss[settled],
        "error_rms": late["error_rms"],
        "z_rms": late["z_rms"],
        "force_elsewhere_largest": elsewhere,
    }
    return [
        TableNumbers(
            force={
                joint: Force(*(float(of(found[:, arm])) for of in (np.mean, np.min, np.max)))
                for joint, found in force.items()
            },
            **{name: float(value[arm]) for name, value in values.items()},
        )
        for arm in range(len(run.seeds))
    ]

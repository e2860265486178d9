"""Parameters of links and arms, validated when they are made; those of motors are in `motor_parameters`."""

from __future__ import annotations

import json
import math
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from elbow_gym.checks import check_entries, finite, non_negative, positive, require_entries
from elbow_gym.motor_parameters import MotorParameters
from elbow_gym.motor_presets import motor

Array = NDArray[np.float64]

MINIMUM_JOINTS = 3
MAXIMUM_JOINTS = 64
PRESET = "preset"
"""Entry of a motor's dict that names one of `motor_presets.MOTORS`."""


def _set(instance: object, name: str, value: object) -> None:
    object.__setattr__(instance, name, value)


def cylinder_axial_inertia(mass: Any, radius: Any) -> Any:
    """Inertia I_s = m r^2 / 2 of a solid cylinder about its axis [kg m^2]; numbers or arrays."""
    return mass * radius**2 / 2.0


def cylinder_transverse_inertia(mass: Any, radius: Any, length: Any) -> Any:
    """Inertia I_t = m (3 r^2 + l^2) / 12 of a solid cylinder across its axis [kg m^2]; numbers or arrays."""
    return mass * (3.0 * radius**2 + length**2) / 12.0


@dataclass(frozen=True, kw_only=True)
class LinkParameters:
    """A uniform solid cylinder, its centre of mass in the middle."""

    mass: float = 0.1
    """Mass m [kg]."""
    length: float = 0.3
    """Length l [m]; zero for link 1, which only carries the yaw."""
    radius: float = 0.01
    """Radius r [m]."""

    def __post_init__(self) -> None:
        _set(self, "mass", positive("mass", self.mass))
        _set(self, "length", non_negative("length", self.length))
        _set(self, "radius", positive("radius", self.radius))

    @property
    def axial_inertia(self) -> float:
        """Inertia I_s about the cylinder's axis [kg m^2]."""
        return cylinder_axial_inertia(self.mass, self.radius)

    @property
    def transverse_inertia(self) -> float:
        """Inertia I_t across the cylinder's axis at the centre of mass [kg m^2]."""
        return cylinder_transverse_inertia(self.mass, self.radius, self.length)


@dataclass(frozen=True, kw_only=True)
class ArmParameters:
    """A serial arm: joint 1 yaws about world z, joints 2..n pitch about parallel horizontal axes.

    All sequences have one entry per joint, joint 1 first. Raises ValueError naming the argument.
    """

    links: tuple[LinkParameters, ...]
    """Links; link k runs from joint k to joint k + 1, the last one to the hand."""
    motors: tuple[MotorParameters, ...]
    """Motors, one per joint."""
    joint_viscous_friction: tuple[float, ...]
    """Viscous friction D of each joint [N m s/rad]."""
    nominal_pose: tuple[float, ...]
    """Joint angles of the start pose [rad], which the PD also keeps on its idle joints."""
    gravity: float = 9.81
    """Gravity g along -z [m/s^2]."""

    def __post_init__(self) -> None:
        n = len(self.links)
        if not MINIMUM_JOINTS <= n <= MAXIMUM_JOINTS:
            raise ValueError(f"links must have {MINIMUM_JOINTS} to {MAXIMUM_JOINTS} entries, got {n}")
        for name in ("motors", "joint_viscous_friction", "nominal_pose"):
            if len(getattr(self, name)) != n:
                raise ValueError(f"{name} must have one entry per link ({n}), got {len(getattr(self, name))}")
        for name, kind in (("links", LinkParameters), ("motors", MotorParameters)):
            for k, part in enumerate(getattr(self, name), start=1):
                if not isinstance(part, kind):
                    raise ValueError(f"{name}[{k}] must be {kind.__name__}, got {part!r}")
        for k, link in enumerate(self.links, start=1):
            if k == 1 and link.length != 0.0:
                raise ValueError(f"length of link 1 must be zero (it only yaws), got {link.length}")
            if k > 1:
                positive(f"length of link {k}", link.length)
        friction = tuple(
            non_negative(f"joint_viscous_friction[{k}]", value)
            for k, value in enumerate(self.joint_viscous_friction, start=1)
        )
        pose = tuple(finite(f"nominal_pose[{k}]", value) for k, value in enumerate(self.nominal_pose, start=1))
        _set(self, "joint_viscous_friction", friction)
        _set(self, "nominal_pose", pose)
        _set(self, "gravity", non_negative("gravity", self.gravity))

    @property
    def n_joints(self) -> int:
        """Number of joints, links and motors."""
        return len(self.links)

    def of_links(self, name: str) -> Array:
        """Quantity of all links by its attribute name, shape (n,)."""
        return np.array([getattr(link, name) for link in self.links])

    def of_motors(self, name: str) -> Array:
        """Quantity of all motors by its attribute name, shape (n,)."""
        return np.array([getattr(motor, name) for motor in self.motors])

    def to_dict(self) -> dict[str, Any]:
        """Parameters as plain JSON types, the inverse of `from_dict`."""
        plain = asdict(self)
        plain.update({key: list(value) for key, value in plain.items() if key != "gravity"})
        return plain

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> ArmParameters:
        """Arm from a dict of `to_dict`, whose motors may also be presets.

        A motor is then the name of one of `motor_presets.MOTORS`, or a dict of that name under "preset" and of fields
        that no sheet has, such as {"preset": "maxon-re40-150w-24v", "gear_ratio": 20.0}. Raises ValueError naming an
        unknown, missing or wrong entry.
        """
        allowed = {field.name for field in fields(cls)}
        check_entries(plain, allowed, "arm")
        require_entries(plain, sorted(allowed - {"gravity"}), "arm")
        values = dict(plain)
        values["links"] = tuple(_part(LinkParameters, part, "links") for part in _sequence("links", plain["links"]))
        values["motors"] = tuple(
            _part(MotorParameters, part, "motors") for part in _sequence("motors", plain["motors"])
        )
        for name in ("joint_viscous_friction", "nominal_pose"):
            values[name] = tuple(_sequence(name, plain[name]))
        return cls(**values)


def _sequence(name: str, value: object) -> Sequence[Any]:
    if not isinstance(value, list | tuple):
        raise ValueError(f"{name} must be a list, got {value!r}")
    return cast("Sequence[Any]", value)


def _part(kind: type[Any], plain: object, owner: str) -> Any:
    may_be_preset = kind is MotorParameters
    if may_be_preset and isinstance(plain, str):
        return motor(plain)
    if not isinstance(plain, Mapping):
        raise ValueError(f"{owner} must hold dicts of {kind.__name__}, got {plain!r}")
    mapping = cast("Mapping[str, Any]", plain)
    if may_be_preset and PRESET in mapping:
        return motor(mapping[PRESET], **{name: value for name, value in mapping.items() if name != PRESET})
    check_entries(mapping, {field.name for field in fields(kind)}, owner)
    return kind(**mapping)


@cache
def paper_arm() -> ArmParameters:
    """The paper's arm: ten joints, its motors, links and start pose (section 4 of the paper)."""
    turns = (0.0, 0.25, 0.5, -0.5, 0.25, 0.25, -0.5, 0.25, -0.25, 0.25)
    n = len(turns)
    return ArmParameters(
        links=(LinkParameters(length=0.0), *(LinkParameters() for _ in range(n - 1))),
        motors=tuple(MotorParameters() for _ in range(n)),
        joint_viscous_friction=(0.5,) * n,
        nominal_pose=tuple(turn * math.pi for turn in turns),
    )


PRESETS = {"paper": paper_arm}
ARM_SUFFIX = ".json"
"""Suffix of a name that is no preset's but an arm's file."""


def read_arm(path: Path) -> ArmParameters:
    """The arm in a JSON file of `ArmParameters.to_dict`. Raises ValueError naming the file, and what is wrong in it."""
    try:
        return as_arm(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError) as error:
        raise ValueError(f"arm must be a JSON file of an arm, got {path}: {error}") from error


def as_arm(arm: object) -> ArmParameters:
    """An arm from a preset name, the path of a .json file, a dict of `ArmParameters.to_dict`, or an ArmParameters."""
    if isinstance(arm, ArmParameters):
        return arm
    if isinstance(arm, str):
        if arm.endswith(ARM_SUFFIX):
            return read_arm(Path(arm))
        if arm not in PRESETS:
            raise ValueError(f"arm must be one of {sorted(PRESETS)} or a {ARM_SUFFIX} file, got {arm!r}")
        return PRESETS[arm]()
    if isinstance(arm, Mapping):
        return ArmParameters.from_dict(cast("Mapping[str, Any]", arm))
    raise ValueError(f"arm must be a preset name, a dict or ArmParameters, got {arm!r}")


def as_elbows(elbows: object, n_joints: int) -> tuple[int, ...]:
    """Elbow joint numbers from 0, 1, 2 (the paper's (), (4,), (4, 7)) or a sequence of joint numbers.

    Joint 3 is the first that can move off the table. Sorted; ValueError otherwise.
    """
    if isinstance(elbows, numbers.Integral) and not isinstance(elbows, bool):
        paper = {0: (), 1: (4,), 2: (4, 7)}
        if int(elbows) not in paper:
            raise ValueError(f"elbows must be 0, 1, 2 or a tuple of joint numbers, got {elbows!r}")
        joints = paper[int(elbows)]
    elif isinstance(elbows, list | tuple) or (isinstance(elbows, np.ndarray) and elbows.ndim == 1):
        listed = cast("Sequence[object]", elbows)
        if not all(isinstance(e, numbers.Integral) and not isinstance(e, bool) for e in listed):
            raise ValueError(f"elbows must be joint numbers (integers), got {elbows!r}")
        joints = tuple(sorted(int(cast("int", e)) for e in listed))
    else:
        raise ValueError(f"elbows must be 0, 1, 2 or a tuple of joint numbers, got {elbows!r}")
    for joint in joints:
        if not 3 <= joint <= n_joints:
            raise ValueError(
                f"elbows must be joints 3 to {n_joints} (joints 1 and 2 sit on the base), got {joint} in {elbows!r}"
            )
    if len(set(joints)) != len(joints):
        raise ValueError(f"elbows must not repeat a joint, got {elbows!r}")
    return joints

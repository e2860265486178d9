"""Arm that the paper's cases are played on: the paper's own, or another one with elbows and a circle in its reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from agents.style import elbow_name, leaning_in_words
from agents.task_options import circle_in_words
from agents.tasks import Elbows
from elbow_gym.kinematics import on_table
from elbow_gym.parameters import ArmParameters, as_elbows, paper_arm, read_arm
from elbow_gym.task.circle import Circle
from elbow_gym.task.default_circle import default_circle


@dataclass(frozen=True)
class Subject:
    """An arm with the elbows of the case that has most; every other case has one elbow less, the outermost.

    All cases start from one pose, which has all elbows on the table, and follow one circle. Raises ValueError unless
    there is an elbow that the arm can lie on.
    """

    elbows: Elbows = 2
    """Elbows of the case that has most, at least one: 1 or 2 as in the paper, or joint numbers."""
    path: Path | None = None
    """JSON file of the arm; the paper's when None."""

    def __post_init__(self) -> None:
        if not self.elbow_joints:
            raise ValueError(
                f"elbows must be at least one, since arms with and without are compared, got {self.elbows}"
            )

    @cached_property
    def arm(self) -> ArmParameters:
        """The arm; the nominal pose has all elbows on the table."""
        arm = paper_arm() if self.path is None else read_arm(self.path)
        if arm == paper_arm() and as_elbows(self.elbows, arm.n_joints) in ((4, 7), (4,)):
            # Its pose has both on the table, to the last bit as published.
            return arm
        pose = on_table(arm, arm.nominal_pose, as_elbows(self.elbows, arm.n_joints))
        return replace(arm, nominal_pose=tuple(pose.tolist()))

    @cached_property
    def elbow_joints(self) -> tuple[int, ...]:
        """Joint numbers of the elbows of the case that has most."""
        return as_elbows(self.elbows, self.arm.n_joints)

    @cached_property
    def circle(self) -> Circle:
        """The circle of all cases."""
        return default_circle(self.arm, self.elbow_joints)

    @property
    def published(self) -> bool:
        """Whether the paper has numbers of this arm on these elbows."""
        return self.arm == paper_arm() and self.elbow_joints in ((4, 7), (4,))

    @property
    def name(self) -> str:
        """Name of the arm for readers."""
        return "the paper's arm" if self.path is None else self.path.name

    @property
    def cases(self) -> tuple[int, ...]:
        """Numbers of elbows of the cases, largest first."""
        return tuple(range(len(self.elbow_joints), -1, -1))

    def arguments(self, elbows: int) -> dict[str, Any]:
        """Arguments of the environment of the case with this number of elbows."""
        if self.published:
            return {"elbows": elbows}
        return {"elbows": self.elbow_joints[:elbows], "arm": self.arm.to_dict(), "circle": self.circle.to_dict()}

    def described(self) -> str:
        """The arm, its elbows and its circle in words."""
        elbows = leaning_in_words(self.elbow_joints)
        return f"{self.name} with {self.arm.n_joints} joints, {elbows}, {circle_in_words(self.circle)}"


def cases_in_words(cases: Sequence[int]) -> str:
    """Numbers of elbows in words, such as "two / one / no elbow"."""
    return " / ".join(elbow_name(elbows).split()[0] for elbows in cases) + " elbow"

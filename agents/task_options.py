"""Options of a command line that choose an environment."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.constructors import PrimitiveConstructorSpec

from agents.cli import JsonObject

if TYPE_CHECKING:
    from elbow_gym.task.circle import Circle
    from elbow_gym.task.settings import Settings


def _elbows(words: list[str]) -> int | tuple[int, ...] | None:
    if words[0] == "None":
        return None
    if not re.fullmatch(r"\d+(,\d+)*", words[0]):
        raise ValueError(f"must be a number of elbows, or joint numbers with commas between, got {words[0]}")
    joints = tuple(map(int, words[0].split(",")))
    # Joints 1 and 2 sit on the base, so that a number up to 2 can only be how many.
    return joints[0] if len(joints) == 1 and joints[0] <= 2 else joints


Elbows = Annotated[
    int | tuple[int, ...] | None,
    PrimitiveConstructorSpec(
        nargs=1,
        metavar="N|JOINTS",
        instance_from_str=_elbows,
        is_instance=lambda value: value is None or isinstance(value, int | tuple),
        str_from_instance=lambda value: [",".join(map(str, value)) if isinstance(value, tuple) else str(value)],
    ),
]
"""Option whose value is a number of elbows, or the numbers of the joints that are held on the table; None leaves
them to the environment."""


EnvironmentId = Literal["ElbowArm-v0", "ElbowArmTable-v0", "ElbowArmRandom-v0", "ElbowArmTasks-v0"]
"""Option whose value is a Gymnasium id."""


@dataclass(frozen=True, kw_only=True)
class TaskOptions:
    """Environment. Its id and the elbows choose the defaults of the algorithm options of a training."""

    env: EnvironmentId = "ElbowArm-v0"
    """Gymnasium id of the environment."""
    elbows: Elbows = None
    """Elbows on the table: a number up to 2 as in the paper, or the joints' numbers, such as 4 or 4,7; those of the
    id, of the policy's file, or else 2, when None."""
    arm: Path | None = None
    """JSON file of another arm, as `ArmParameters.to_dict` has it; its circle is one in its reach."""
    environment: JsonObject = field(default_factory=dict)
    """Further arguments of the environment, such as '{"energy_weight": 0.002}'."""

    @property
    def name(self) -> str:
        """Short name of the task, such as "elbows2"."""
        from elbow_gym.baselines.tasks import task_name

        return task_name(self.env, self.elbows)

    def arguments(self) -> dict[str, Any]:
        """Arguments of the environment besides its id and its elbows.

        Raises:
            ValueError: `environment` holds an argument that no environment has, or elbows; or the arm is given twice.
        """
        from elbow_gym.parameters import read_arm
        from elbow_gym.task.settings import Settings

        allowed = sorted({field.name for field in fields(Settings)} - {"elbows"})
        for name in self.environment:
            if name not in allowed:
                raise ValueError(f"--environment must hold only {', '.join(allowed)}, got {name} (elbows: --elbows)")
        if self.arm is None:
            return dict(self.environment)
        if "arm" in self.environment:
            raise ValueError(f"--arm must not be given beside an arm in --environment, got {self.arm}")
        return {**self.environment, "arm": read_arm(self.arm).to_dict()}

    def settings(self) -> Settings:
        """Settings of the environment. Raises ValueError as `arguments` does, or where a value is refused."""
        from agents.tasks import task_settings

        try:
            return task_settings(self.env, self.elbows, self.arguments())
        except TypeError as error:
            given = json.dumps(self.environment)
            raise ValueError(f"--environment must hold values of the right type, got {given} ({error})") from error

    def tell(self, settings: Settings) -> None:
        """Says on stderr which circle an arm of the user's own follows."""
        if self.arm is None:
            return
        print(f"{self.arm}: {circle_in_words(settings.parsed_circle.widest)}", file=sys.stderr)


def circle_in_words(circle: Circle) -> str:
    """Radius and centre of a circle that is not drawn."""
    center = ", ".join(f"{value:.4g}" for value in circle.center)
    return f"circle of {circle.radius:.4g} m around ({center}) m"

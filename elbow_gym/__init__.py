"""elbow_gym: a Gymnasium environment of the multi-point-elbow arm that asks what motion costs in joules."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gymnasium.envs.registration import register  # pyright: ignore[reportUnknownVariableType]

if TYPE_CHECKING:
    from elbow_gym.circle import Circle
    from elbow_gym.env import ElbowArmEnv
    from elbow_gym.parameters import ArmParameters, LinkParameters, MotorParameters, paper_arm
    from elbow_gym.simulator import Simulator
    from elbow_gym.table import TableParameters
    from elbow_gym.vector_env import ElbowArmVectorEnv

__version__ = "0.1.0"

# Names are imported when first asked for, so that `import elbow_gym` loads no compiler.
_HOMES = {
    "ArmParameters": "parameters",
    "Circle": "circle",
    "ElbowArmEnv": "env",
    "ElbowArmVectorEnv": "vector_env",
    "LinkParameters": "parameters",
    "MotorParameters": "parameters",
    "Simulator": "simulator",
    "TableParameters": "table",
    "paper_arm": "parameters",
}

__all__ = [
    "ArmParameters",
    "Circle",
    "ElbowArmEnv",
    "ElbowArmVectorEnv",
    "LinkParameters",
    "MotorParameters",
    "Simulator",
    "TableParameters",
    "paper_arm",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


register(
    id="ElbowArm-v0",
    entry_point="elbow_gym.env:ElbowArmEnv",
    vector_entry_point="elbow_gym.vector_env:ElbowArmVectorEnv",
)

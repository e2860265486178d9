"""elbow_gym: a Gymnasium environment of the multi-point-elbow arm that asks what motion costs in joules."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gymnasium.envs.registration import register  # pyright: ignore[reportUnknownVariableType]

if TYPE_CHECKING:
    from elbow_gym.baselines.pd import PDController
    from elbow_gym.baselines.policy import load_policy
    from elbow_gym.env import ElbowArmEnv
    from elbow_gym.interface import Interface
    from elbow_gym.motor_presets import motor
    from elbow_gym.multi_objective import MOElbowArmEnv, MOElbowArmVectorEnv
    from elbow_gym.parameters import ArmParameters, LinkParameters, MotorParameters, paper_arm
    from elbow_gym.simulation.options import Conditions
    from elbow_gym.simulator import Simulator
    from elbow_gym.suite import evaluation_tasks, reset_options
    from elbow_gym.table import TableParameters
    from elbow_gym.task.circle import Circle
    from elbow_gym.vector_env import ElbowArmVectorEnv

__version__ = "0.1.0"

# Names are imported when first asked for, so that `import elbow_gym` loads no compiler.
_HOMES = {
    "ArmParameters": "parameters",
    "Circle": "task.circle",
    "Conditions": "simulation.options",
    "ElbowArmEnv": "env",
    "ElbowArmVectorEnv": "vector_env",
    "Interface": "interface",
    "LinkParameters": "parameters",
    "MOElbowArmEnv": "multi_objective",
    "MOElbowArmVectorEnv": "multi_objective",
    "MotorParameters": "parameters",
    "PDController": "baselines.pd",
    "Simulator": "simulator",
    "TableParameters": "table",
    "evaluation_tasks": "suite",
    "load_policy": "baselines.policy",
    "motor": "motor_presets",
    "paper_arm": "parameters",
    "reset_options": "suite",
}

__all__ = [
    "ArmParameters",
    "Circle",
    "Conditions",
    "ElbowArmEnv",
    "ElbowArmVectorEnv",
    "Interface",
    "LinkParameters",
    "MOElbowArmEnv",
    "MOElbowArmVectorEnv",
    "MotorParameters",
    "PDController",
    "Simulator",
    "TableParameters",
    "evaluation_tasks",
    "load_policy",
    "motor",
    "paper_arm",
    "reset_options",
]


# A type checker that sees it would take every misspelt name for Any.
if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name in _HOMES:
            return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


# The table alone carries the arm, so that the policy decides where to brace.
TABLE: dict[str, Any] = {"elbows": 0, "table": True}
# Arm and circle differ in every episode.
RANDOM: dict[str, Any] = {
    "circle": {
        "center": [[1.45, 1.55], [1.45, 1.55], [0.35, 0.45]],
        "radius": [0.05, 0.15],
        "period": [4.0, 6.0],
        "phase": "random",
        "direction": "random",
    },
    "randomize": {
        "mass": [0.8, 1.2],
        "length": [0.98, 1.02],
        "joint_viscous_friction": [0.7, 1.3],
        "gear_viscous_friction": [0.7, 1.3],
        "torque_constant": [0.95, 1.05],
        "armature_resistance": [0.9, 1.1],
        "supply_voltage": [0.95, 1.05],
        "payload": [0.0, 0.1],
        "sensor_noise": [0.0, 0.002],
    },
}

# Circle, payload and start pose differ in every episode, and the observation says which task it is.
TASKS: dict[str, Any] = {
    "circle": {
        "center": [[1.35, 1.65], [1.35, 1.65], [0.25, 0.55]],
        "radius": [0.05, 0.15],
        "period": [3.0, 8.0],
        # Up to 45 degrees.
        "tilt": [0.0, 0.7853981633974483],
        "tilt_axis": "random",
        "phase": "random",
        "direction": "random",
    },
    "randomize": "tasks",
    "start_noise": 0.0,
    "start_spread": 0.3,
    "task_observation": True,
}

for _name, _arguments in {"": {}, "Table": TABLE, "Random": RANDOM, "Tasks": TASKS}.items():
    register(
        id=f"ElbowArm{_name}-v0",
        entry_point="elbow_gym.env:ElbowArmEnv",
        vector_entry_point="elbow_gym.vector_env:ElbowArmVectorEnv",
        kwargs=_arguments,
    )
# Gymnasium's own checker knows scalar rewards only.
register(
    id="mo-ElbowArm-v0",
    entry_point="elbow_gym.multi_objective:MOElbowArmEnv",
    vector_entry_point="elbow_gym.multi_objective:MOElbowArmVectorEnv",
    disable_env_checker=True,
)

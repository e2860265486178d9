"""Style of the figures: one colour for each controller and elbow count everywhere (Okabe and Ito's palette)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

DPI = 160
TARGET_COLOUR = "#000000"
ELBOW_COLOURS = {2: "#0072B2", 1: "#E69F00", 0: "#D55E00"}
ELBOW_NAMES = {2: "two elbows", 1: "one elbow", 0: "no elbow"}
CONTROLLER_COLOURS = {
    "pd_paper": "#D55E00",
    "pd": "#E69F00",
    "pd_smooth": "#F0E442",
    "pd_gravity": "#CC79A7",
    "computed_torque": "#56B4E9",
    "computed_torque_posture": "#666666",
    "lqr": "#000000",
    "ppo": "#0072B2",
    "sac": "#009E73",
    "clone": "#882255",
    "ppo_cloned": "#7FB2D8",
    "ppo_random": "#00395B",
    "sac_cloned": "#80CEB9",
    "sac_random": "#005A41",
    "ppo_tasks": "#3A2DB0",
    "sac_tasks": "#33BBEE",
    "newton": "#CC6677",
    "newton_tasks": "#CC6677",
    "receding_horizon": "#AA3377",
    "sampling_mpc": "#BBBB33",
    "receding_horizon_payload": "#D499BB",
    "sampling_mpc_payload": "#77771F",
}
CONTROLLER_NAMES = {
    "pd_paper": "PD, no limit",
    "pd": "PD, 24 V",
    "pd_smooth": "PD, smooth start",
    "pd_gravity": "PD + gravity",
    "computed_torque": "computed torque",
    "computed_torque_posture": "computed torque, posture",
    "lqr": "LQR on the optimum",
    "ppo": "PPO, 24 V",
    "sac": "SAC from computed torque",
    "clone": "clone of one optimum",
    "ppo_cloned": "PPO from the optimum's clone",
    "ppo_random": "PPO, drawn arms and circles",
    "sac_cloned": "SAC from the optimum's clone",
    "sac_random": "SAC, drawn arms and circles",
    "ppo_tasks": "PPO, drawn tasks",
    "sac_tasks": "SAC, drawn tasks",
    "newton": "Newton's steps",
    "newton_tasks": "Newton's steps, drawn tasks",
    "receding_horizon": "receding horizon",
    "sampling_mpc": "sampling MPC",
    "receding_horizon_payload": "receding horizon, adaptive",
    "sampling_mpc_payload": "sampling MPC, adaptive",
}
CONTROLLER_MARKERS = {
    "pd_paper": "v",
    "pd": "^",
    "pd_smooth": "s",
    "pd_gravity": "D",
    "computed_torque": "o",
    "computed_torque_posture": "P",
    "lqr": "*",
    "ppo": "X",
    "sac": "h",
    "clone": "d",
    "ppo_cloned": ">",
    "ppo_random": "<",
    "sac_cloned": "p",
    "sac_random": "H",
    "ppo_tasks": "3",
    "sac_tasks": "4",
    "newton": "+",
    "newton_tasks": "+",
    "receding_horizon": "8",
    "sampling_mpc": ".",
    "receding_horizon_payload": "1",
    "sampling_mpc_payload": "2",
}


SPARE_COLOURS = ("#A6761D", "#7570B3", "#E7298A", "#66A61E")
"""Colours of controllers that have none here; which is whose follows from their names."""


def look(name: str) -> tuple[str, str, str]:
    """A controller's name for readers, its colour #rrggbb and its marker; a spare colour and a disc where it has none.

    The name of a path is its last part.
    """
    spare = SPARE_COLOURS[sum(name.encode()) % len(SPARE_COLOURS)]
    return (
        CONTROLLER_NAMES.get(name, Path(name).name),
        CONTROLLER_COLOURS.get(name, spare),
        CONTROLLER_MARKERS.get(name, "o"),
    )


def elbow_name(elbows: int) -> str:
    """A number of elbows in words."""
    return ELBOW_NAMES.get(elbows, f"{elbows} elbows")


def joints_in_words(joints: Sequence[int]) -> str:
    """Joint numbers, at least one, such as "joint 4" or "joints 4 and 7"."""
    first, last = ", ".join(map(str, joints[:-1])), str(joints[-1])
    return f"joints {first} and {last}" if first else f"joint {last}"


def leaning_in_words(elbow_joints: Sequence[int]) -> str:
    """Joints that are held on the table, such as "elbows on joints 4 and 7"; "no elbow" without one."""
    return f"elbows on {joints_in_words(elbow_joints)}" if elbow_joints else elbow_name(0)


def elbow_colour(elbows: int) -> str:
    """Colour of a number of elbows, #rrggbb; a spare one beyond two."""
    return ELBOW_COLOURS.get(elbows, SPARE_COLOURS[(elbows - 3) % len(SPARE_COLOURS)])


def pyplot() -> Any:
    """Matplotlib's pyplot on the file backend, with the project's defaults."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update(
        {
            "figure.dpi": DPI,
            "savefig.dpi": DPI,
            "axes.grid": True,
            "grid.alpha": 0.3,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "legend.frameon": False,
            "font.size": 9,
        }
    )
    return plt

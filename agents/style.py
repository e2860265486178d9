"""How figures look: the same colour for the same controller or elbow count everywhere (Okabe and Ito's palette)."""

from __future__ import annotations

from typing import Any

DPI = 160
TARGET_COLOUR = "#000000"
ELBOW_COLOURS = {2: "#0072B2", 1: "#E69F00", 0: "#D55E00"}
ELBOW_NAMES = {2: "two elbows", 1: "one elbow", 0: "no elbow"}
CONTROLLER_COLOURS = {"pd_paper": "#D55E00", "pd_24v": "#E69F00", "ppo": "#0072B2", "sac": "#009E73"}
CONTROLLER_NAMES = {"pd_paper": "PD, no limit", "pd_24v": "PD, 24 V", "ppo": "PPO, 24 V", "sac": "SAC, 24 V"}


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

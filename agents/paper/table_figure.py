"""Figure of the runs on a table that cannot pull: energy, error, hand and forces."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from agents.evaluation.recording import thinned
from agents.paper.figures import SETTLED
from agents.paper.table_cases import CLEAR, TableNumbers, TableRecording
from agents.style import ELBOW_COLOURS, SPARE_COLOURS, TARGET_COLOUR, pyplot

Runs = Mapping[float, TableRecording]
"""Runs by friction; their arms are the starts of `table_cases.lifts`."""
Starts = Mapping[str, TableNumbers]
"""Numbers by start."""

METRICS = {
    "energy_tracking": f"energy from t = {SETTLED:g} s on [J]",
    "energy": "energy of the whole run [J]",
    "error_rms": f"hand error rms, t > {SETTLED:g} s [mm]",
}
"""Titles of the panels above by the number that they show."""
COLOURS = (*ELBOW_COLOURS.values(), *SPARE_COLOURS)
"""Colours of the starts in their order."""
PICTURE_PERIOD = 0.005
"""Time between the points of the curves [s]."""


def table_figure(runs: Runs, numbers: Mapping[float, Starts]) -> Any:
    """Above, energy and error by start and friction; below, the hand of the leaning arm and the table's forces.

    Args:
        runs: runs by friction.
        numbers: what was measured of them, by friction and start.
    """
    joints = list(next(iter(next(iter(numbers.values())).values())).force)
    # Above are three panels, below one for the hand and one for each joint that may lean.
    columns = math.lcm(3, 1 + len(joints))
    above = [name for name in METRICS for _ in range(columns // 3)]
    below = [name for name in ("hand", *map(str, joints)) for _ in range(columns // (1 + len(joints)))]
    fig, grid = pyplot().subplot_mosaic([above, below], figsize=(10.0, 6.4), layout="constrained")
    for name, title in METRICS.items():
        values = {
            friction: {start: getattr(n, name) for start, n in starts.items()} for friction, starts in numbers.items()
        }
        _bars(grid[name], values)
        grid[name].set_title(title)
    _paths(grid["hand"], runs)
    for joint in joints:
        _forces(grid[str(joint)], runs[min(runs)], joint)
        grid[str(joint)].set_title(f"force on joint {joint}, friction {min(runs):g} [N]")
    handles = grid["energy"].get_legend_handles_labels()
    fig.legend(*handles, loc="outside lower center", ncols=len(handles[0]))
    fig.suptitle("The paper's PD on a table that gives way and cannot pull")
    return fig


def _bars(panel: Any, values: Mapping[float, Mapping[str, float]]) -> None:
    names = list(next(iter(values.values())))
    width = 0.84 / len(names)
    for number, start in enumerate(names):
        heights = [starts[start] for starts in values.values()]
        places = np.arange(len(values)) + width * (number - (len(names) - 1) / 2.0)
        label = "held clear" if start == CLEAR else f"leaning on {start}"
        bars = panel.bar(places, heights, width - 0.02, color=COLOURS[number], label=label)
        panel.bar_label(bars, fmt="%.3g" if max(heights) < 1000.0 else "%.0f", fontsize=7)
    panel.set_xticks(range(len(values)), [f"{friction:g}" for friction in values])
    panel.set_xlabel("friction of the table [-]")
    panel.grid(axis="x", visible=False)


def _paths(panel: Any, runs: Runs) -> None:
    """The hand from above, of the arm that leans on most joints."""
    for style, (friction, whole) in zip(("-", "--", ":"), runs.items(), strict=True):
        run = thinned(whole, PICTURE_PERIOD)
        late = run.time >= SETTLED - 1e-9
        panel.plot(*run.hand[late, 0, :2].T, style, color=COLOURS[0], label=f"friction {friction:g}")
    panel.plot(*run.target[:, 0, :2].T, color=TARGET_COLOUR, lw=0.8, label="target")
    panel.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title=f"hand from above, t > {SETTLED:g} s")
    panel.legend(fontsize=7, loc="center")


def _forces(panel: Any, whole: TableRecording, joint: int) -> None:
    run = thinned(whole, PICTURE_PERIOD)
    arms = len(run.seeds)
    for arm in range(arms):
        # The first contact is joint 3's.
        panel.plot(run.time, run.normal_force[:, arm, joint - 3], color=COLOURS[arm], lw=1.0 + 0.8 * (arms - 1 - arm))
    panel.set(xlabel="time [s]", xlim=(0.0, run.time[-1]))

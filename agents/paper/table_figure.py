"""Figure of the runs on a table that cannot pull: energy, error, hand and forces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from agents.evaluation.recording import thinned
from agents.paper.figures import SETTLED
from agents.paper.table_cases import LIFTS, TableRecording, measure_on_table
from agents.style import ELBOW_COLOURS, TARGET_COLOUR, pyplot

Runs = Mapping[float, TableRecording]
"""Runs by friction; their arms are the starts of `LIFTS`."""

COLOURS = dict(zip(LIFTS, ELBOW_COLOURS.values(), strict=True))
NAMES = {"joints 4 and 7": "leaning on joints 4 and 7", "joint 4": "leaning on joint 4", "clear": "held clear"}
PICTURE_PERIOD = 0.005
"""Time between the points of the curves [s]."""


def table_figure(runs: Runs) -> Any:
    """Above, energy and error by start and friction; below, the hand of the leaning arm and the table's forces."""
    numbers = {friction: dict(zip(LIFTS, measure_on_table(run), strict=True)) for friction, run in runs.items()}
    fig, grid = pyplot().subplots(2, 3, figsize=(10.0, 6.4), layout="constrained")
    for panel, name, title in zip(
        grid[0],
        ("energy_tracking", "energy", "error_rms"),
        (
            f"energy from t = {SETTLED:g} s on [J]",
            "energy of the whole run [J]",
            f"hand error rms, t > {SETTLED:g} s [mm]",
        ),
        strict=True,
    ):
        _bars(panel, {mu: {start: getattr(n, name) for start, n in starts.items()} for mu, starts in numbers.items()})
        panel.set_title(title)
    _paths(grid[1, 0], runs)
    for panel, joint in zip(grid[1, 1:], (4, 7), strict=True):
        _forces(panel, runs[min(runs)], joint)
        panel.set_title(f"force on joint {joint}, friction {min(runs):g} [N]")
    fig.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    fig.suptitle("The paper's PD on a table that gives way and cannot pull")
    return fig


def _bars(panel: Any, values: Mapping[float, Mapping[str, float]]) -> None:
    for shift, start in enumerate(LIFTS):
        heights = [starts[start] for starts in values.values()]
        places = np.arange(len(values)) + 0.28 * (shift - 1)
        bars = panel.bar(places, heights, 0.26, color=COLOURS[start], label=NAMES[start])
        panel.bar_label(bars, fmt="%.3g" if max(heights) < 1000.0 else "%.0f", fontsize=7)
    panel.set_xticks(range(len(values)), [f"{friction:g}" for friction in values])
    panel.set_xlabel("friction of the table [-]")
    panel.grid(axis="x", visible=False)


def _paths(panel: Any, runs: Runs) -> None:
    """The hand from above, of the arm that leans on two joints."""
    for style, (friction, whole) in zip(("-", "--", ":"), runs.items(), strict=True):
        run = thinned(whole, PICTURE_PERIOD)
        late = run.time >= SETTLED - 1e-9
        panel.plot(*run.hand[late, 0, :2].T, style, color=COLOURS["joints 4 and 7"], label=f"friction {friction:g}")
    panel.plot(*run.target[:, 0, :2].T, color=TARGET_COLOUR, lw=0.8, label="target")
    panel.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title=f"hand from above, t > {SETTLED:g} s")
    panel.legend(fontsize=7, loc="center")


def _forces(panel: Any, whole: TableRecording, joint: int) -> None:
    run = thinned(whole, PICTURE_PERIOD)
    for arm, start in enumerate(LIFTS):
        # The first contact is joint 3's.
        panel.plot(run.time, run.normal_force[:, arm, joint - 3], color=COLOURS[start], lw=(2.6, 1.8, 1.0)[arm])
    panel.set(xlabel="time [s]", xlim=(0.0, run.time[-1]))

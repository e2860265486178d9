"""The energy benchmark's figures: all controllers by regime, and the energy of every joint."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agents.evaluation.metrics import REGIMES
from agents.style import CONTROLLER_COLOURS, CONTROLLER_NAMES, ELBOW_NAMES, pyplot
from benchmarks.energy.cells import ELBOW_COUNTS

if TYPE_CHECKING:
    from benchmarks.energy.rows import Row

JOINTS_OF = ("pd_24v", "pd_gravity", "computed_torque_posture", "lqr", "ppo", "sac")
"""Whose joints are shown beside each other."""


def figure(rows: Sequence[Row], path: Path) -> None:
    """Energy and tracking error of every controller, by regime and elbow count, on logarithmic axes."""
    plt = pyplot()
    controllers = list(dict.fromkeys(row.controller for row in rows))
    fig, axes = plt.subplots(2, len(REGIMES), figsize=(10, 6), sharex=True, sharey="row", layout="constrained")
    panels = (("electrical_energy", "electrical energy (J)"), ("error_rms", "hand error, rms (mm)"))
    width = 0.8 / len(controllers)
    for column, regime in enumerate(REGIMES):
        axes[0, column].set_title(f"{regime.name}: {regime.meaning}", fontsize=9)
        for line, (metric, label) in enumerate(panels):
            ax = axes[line, column]
            for k, controller in enumerate(controllers):
                chosen = [row for row in rows if row.controller == controller and row.regime == regime.name]
                places = [ELBOW_COUNTS.index(row.elbows) + (k - (len(controllers) - 1) / 2) * width for row in chosen]
                estimates = [row.figures[metric] for row in chosen]
                values = [e.value for e in estimates]
                spread = [[e.value - e.low for e in estimates], [e.high - e.value for e in estimates]]
                colour, name = CONTROLLER_COLOURS[controller], CONTROLLER_NAMES[controller]
                ax.bar(places, values, width, yerr=spread, color=colour, label=name, error_kw={"lw": 1})
            ax.set_yscale("log")
            ax.grid(axis="x", visible=False)
            ax.set_xticks(range(len(ELBOW_COUNTS)), [ELBOW_NAMES[elbows] for elbows in ELBOW_COUNTS])
            if column == 0:
                ax.set_ylabel(label)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper center", ncols=min(5, len(controllers)))
    fig.savefig(path)
    plt.close(fig)


def joints(rows: Sequence[Row], path: Path) -> None:
    """Signed electrical energy of every joint, the PD beside the learned: whole run above, from 2 s on below."""
    plt = pyplot()
    shown = [name for name in JOINTS_OF if any(row.controller == name for row in rows)]
    fig, axes = plt.subplots(2, len(ELBOW_COUNTS), figsize=(10, 5.6), sharex=True, layout="constrained")
    width = 0.8 / max(1, len(shown))
    for line, regime in enumerate(REGIMES[:2]):
        for ax, elbows in zip(axes[line], ELBOW_COUNTS, strict=True):
            for k, name in enumerate(shown):
                for row in rows:
                    if (row.controller, row.elbows, row.regime) == (name, elbows, regime.name):
                        places = np.arange(1, len(row.joint_energy) + 1) + (k - (len(shown) - 1) / 2) * width
                        ax.bar(
                            places,
                            row.joint_energy,
                            width,
                            color=CONTROLLER_COLOURS[name],
                            label=CONTROLLER_NAMES[name],
                        )
                        ax.set_xticks(range(1, len(row.joint_energy) + 1))
            # A joint can give energy back; between -1 and 1 J the axis is linear.
            ax.set_yscale("symlog", linthresh=1.0)
            ax.grid(axis="x", visible=False)
            ax.set_axisbelow(True)
            ax.axhline(0.0, color="black", lw=0.6)
            if line == 0:
                ax.set_title(ELBOW_NAMES[elbows])
            else:
                ax.set_xlabel("joint")
        axes[line, 0].set_ylabel(f"electrical energy (J)\n{regime.meaning.split(': ')[-1]}")
    named = {}
    for ax in axes.flat:
        handles, labels = ax.get_legend_handles_labels()
        named.update(zip(labels, handles, strict=True))
    fig.legend(named.values(), named.keys(), loc="outside upper center", ncols=min(6, max(1, len(named))))
    fig.savefig(path)
    plt.close(fig)

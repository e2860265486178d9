"""The energy benchmark's figures: the controllers that matter side by side, and the energy of every joint."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from agents.evaluation.metrics import REGIMES
from agents.evaluation.players import ELBOW_COUNTS
from agents.style import ELBOW_COLOURS, elbow_name, look, pyplot
from benchmarks.energy.cells import featured

if TYPE_CHECKING:
    from benchmarks.energy.rows import Row

JOINTS_OF = ("pd", "pd_gravity", "computed_torque_posture", "lqr", "ppo", "sac")
"""Controllers whose joints are shown side by side."""


class Panel(NamedTuple):
    """A panel of the comparison."""

    regime: str
    metric: str
    title: str
    label: str


PANELS = (
    Panel("A", "electrical_energy", "A: reach and track, 0-5 s", "electrical energy (J)"),
    Panel("B", "electrical_energy", "B: track, 2-5 s", "electrical energy (J)"),
    Panel("B", "error_rms", "B: track, 2-5 s", "hand error, rms (mm)"),
)
BEARING_MARKERS = {2: "o", 1: "s", 0: "^"}
LEAST_SPAN = 10.0
"""Largest value of an axis over its smallest, at least [-]."""
APART = 0.2
"""Distance between the points of two elbow counts, as a multiple of that between two controllers [-]."""


def figure(rows: Sequence[Row], path: Path) -> None:
    """Energy and error of the `featured` from the paper's pose as points with 95 % intervals, on logarithmic axes.

    A line for each controller, the best return with most elbows at the top; colour and marker say the elbow count.
    """
    plt = pyplot()
    from matplotlib.ticker import FixedLocator, NullFormatter, StrMethodFormatter

    chosen = {(row.controller, row.elbows, row.regime): row for row in rows if featured(row.controller)}

    def merit(controller: str) -> float:
        most = max(elbows for name, elbows, _ in chosen if name == controller)
        return chosen[controller, most, "A"].figures["return"].value

    controllers = sorted({name for name, _, _ in chosen}, key=merit)
    height = 1.5 + 0.4 * max(1, len(controllers))
    fig, axes = plt.subplots(1, len(PANELS), figsize=(10, height), sharey=True, layout="constrained")
    for ax, panel in zip(axes, PANELS, strict=True):
        for elbows in sorted({count for _, count, _ in chosen}, reverse=True):
            shift = APART * (elbows - 1)
            shown = [(k + shift, chosen.get((name, elbows, panel.regime))) for k, name in enumerate(controllers)]
            points = [(k, row.figures[panel.metric]) for k, row in shown if row is not None]
            values = [estimate.value for _, estimate in points]
            spread = [[e.value - e.low for _, e in points], [e.high - e.value for _, e in points]]
            ax.errorbar(
                values,
                [k for k, _ in points],
                xerr=spread,
                fmt=BEARING_MARKERS.get(elbows, "D"),
                color=ELBOW_COLOURS.get(elbows, "#000000"),
                markersize=5.5,
                capsize=3.5,
                lw=1.5,
                zorder=3,
                label=elbow_name(elbows),
            )
        ax.set_xscale("log")
        low, high = ax.get_xlim()
        # Controllers that are alike are to look alike, and a tick is to be between the ends.
        wider = max(1.0, np.sqrt(LEAST_SPAN * low / high))
        low, high = ax.set_xlim(low / wider, high * wider)
        ticks = [step * 10.0**power for power in range(-6, 7) for step in (1.0, 3.0)]
        ax.xaxis.set_major_locator(FixedLocator([tick for tick in ticks if low <= tick <= high]))
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_title(panel.title, fontsize=11)
        ax.set_xlabel(panel.label, fontsize=11)
        ax.tick_params(labelsize=10)
    axes[0].set_yticks(range(len(controllers)), [look(name)[0] for name in controllers], fontsize=11)
    axes[0].set_ylim(-0.5, len(controllers) - 0.5)
    fig.legend(
        *axes[0].get_legend_handles_labels(),
        loc="outside upper center",
        ncols=3,
        fontsize=11,
        title="elbows on the table; interquartile means with 95 % intervals",
        title_fontsize=10,
    )
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
                            color=look(name)[1],
                            label=look(name)[0],
                        )
                        ax.set_xticks(range(1, len(row.joint_energy) + 1))
            # A joint can give energy back; between -1 and 1 J the axis is linear.
            ax.set_yscale("symlog", linthresh=1.0)
            ax.grid(axis="x", visible=False)
            ax.set_axisbelow(True)
            ax.axhline(0.0, color="black", lw=0.6)
            if line == 0:
                ax.set_title(elbow_name(elbows))
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

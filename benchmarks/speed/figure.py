"""Figure of the speed benchmark: an RK4 step by contender, and its time against the number of joints."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from agents.style import pyplot
from benchmarks.speed.own import CASES, EULER_STEP, OURS, PAPER, PAPER_CASE, RK4_STEP
from benchmarks.speed.peers import C_LOOP, MUJOCO, PINOCCHIO

if TYPE_CHECKING:
    from benchmarks.speed.rows import Row

# Okabe and Ito's palette.
COLOURS = {OURS: "#0072B2", MUJOCO: "#E69F00", PINOCCHIO: "#009E73", PAPER: "#D55E00"}
LINES = (
    (OURS, "batch", RK4_STEP, "o", "-"),
    (OURS, "single arm", RK4_STEP, "s", "--"),
    (MUJOCO, C_LOOP, RK4_STEP, "^", "-"),
    (MUJOCO, C_LOOP, EULER_STEP, "v", "--"),
)


def figure(rows: Sequence[Row], path: Path) -> None:
    """Bars of the time per step of the paper's arm with two elbows, and lines over 4 to 40 joints."""
    plt = pyplot()
    fig, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained", width_ratios=(1.25, 1))
    steps = [
        row
        for row in rows
        if row.contender.unit in {RK4_STEP, EULER_STEP} and (row.contender.joints, row.contender.elbows) == PAPER_CASE
    ]
    steps.sort(key=lambda row: -row.median)
    for place, row in enumerate(steps):
        low, median, high = (1e6 * value for value in row.quartiles)
        colour = COLOURS[row.contender.family]
        left.barh(place, median, color=colour, xerr=[[median - low], [high - median]], error_kw={"lw": 1})
        written = f"{median:,.0f}" if median >= 100.0 else f"{median:.3g}"
        left.annotate(written, (high, place), xytext=(4, 0), textcoords="offset points", va="center")
    left.set_yticks(range(len(steps)), [_label(row) for row in steps])
    left.set_xscale("log")
    if steps:
        left.set_xlim(min(row.median for row in steps) * 1e6 / 3.0, max(row.median for row in steps) * 8e6)
    left.grid(axis="y", visible=False)
    left.set_xlabel("time per step and arm (µs)")
    left.set_title("One step of the ten-joint arm with two elbows", fontsize=9)

    sizes = sorted(
        (joints, elbows) for joints, elbows in CASES if joints != PAPER_CASE[0] or (joints, elbows) == PAPER_CASE
    )
    for family, name, unit, marker, style in LINES:
        found = {
            (row.contender.joints, row.contender.elbows): 1e6 * row.median
            for row in rows
            if (row.contender.family, row.contender.name, row.contender.unit) == (family, name, unit)
        }
        line = [(joints, found[joints, elbows]) for joints, elbows in sizes if (joints, elbows) in found]
        if line:
            label = f"{family}, {name}" + ("" if family == OURS else f", {unit}")
            right.plot(*zip(*line, strict=True), marker=marker, ls=style, color=COLOURS[family], label=label)
    right.set_xscale("log")
    right.set_yscale("log")
    right.set_xticks([joints for joints, _ in sizes], [str(joints) for joints, _ in sizes])
    right.minorticks_off()
    right.set_xlabel("joints")
    right.set_ylabel("time per step and arm (µs)")
    right.set_title("Cost against the number of joints (elbows on the table)", fontsize=9)
    for axis in (left.xaxis, right.yaxis):
        axis.set_major_formatter(lambda value, _: f"{value:,.10g}")
    handles, labels = right.get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower right", ncols=len(labels))
    fig.savefig(path)
    plt.close(fig)


def _label(row: Row) -> str:
    who = row.contender
    kind = "" if who.unit == RK4_STEP and who.family != MUJOCO else f", {who.unit.removesuffix(' step')}"
    return f"{who.family}{kind}\n{who.name}" if who.family == PAPER else f"{who.family}{kind}, {who.name}"

"""Figures of the speed benchmark: a step by contender and number of joints, and work and precision."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from agents.style import pyplot
from benchmarks.speed.markdown import EQUAL_COST
from benchmarks.speed.own import CASES, EULER_STEP, EXPONENTIAL_STEP, OURS, PAPER, PAPER_CASE, RK4_STEP
from benchmarks.speed.peers import C_LOOP, MUJOCO, PINOCCHIO
from benchmarks.speed.precision import BATCH, ERROR, GROWING

if TYPE_CHECKING:
    from benchmarks.speed.precision import Method
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
    """Bars of the CPU time per step of the paper's arm with two elbows, and lines over 4 to 40 joints."""
    plt = pyplot()
    fig, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained", width_ratios=(1.25, 1))
    steps = [
        row
        for row in rows
        if row.contender.unit in {RK4_STEP, EXPONENTIAL_STEP, EULER_STEP}
        and (row.contender.joints, row.contender.elbows) == PAPER_CASE
        and row.contender.clock == "cpu"
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
    left.set_xlabel("CPU time per step and arm (µs)")
    left.set_title(f"One step of the ten-joint arm with two elbows\n({EQUAL_COST})", fontsize=9)

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
    right.set_ylabel("CPU time per step and arm (µs)")
    right.set_title(f"One step by number of joints, with elbows\n({EQUAL_COST})", fontsize=9)
    for axis in (left.xaxis, right.yaxis):
        axis.set_major_formatter(lambda value, _: f"{value:,.10g}")
    handles, labels = right.get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower right", ncols=len(labels))
    fig.savefig(path)
    plt.close(fig)


LOOKS = {
    (OURS, GROWING, BATCH): ("#0072B2", "D", "-"),
    (OURS, GROWING, 1): ("#56B4E9", "D", "-"),
    (OURS, "exponential", 1): ("#009E73", "o", "-"),
    (OURS, "rk4", 1): ("#CC79A7", "s", "--"),
    (MUJOCO, "Euler", 1): ("#E69F00", "v", "-"),
    (MUJOCO, "implicitfast", 1): ("#D55E00", "+", ":"),
    (MUJOCO, "RK4", 1): ("#000000", "^", "--"),
}
"""Colour, marker and line of each method."""


def work_precision(methods: Sequence[Method], path: Path) -> None:
    """Errors of the state and of the energy after a simulated second against its CPU time, a line per method."""
    plt = pyplot()
    fig, axes = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained", sharex=True)
    for method in methods:
        colour, marker, style = LOOKS[method.family, method.integrator, method.arms]
        arms = "" if method.family == MUJOCO else f", batch of {method.arms}" if method.arms > 1 else ", single arm"
        label = f"{method.family}, {method.integrator}{arms}, order {method.order:.1f}"
        times = [1e3 * point.time for point in method.points]
        for axis, errors in zip(
            axes,
            ([p.state_error for p in method.points], [p.energy_error for p in method.points]),
            strict=True,
        ):
            axis.plot(times, errors, color=colour, marker=marker, ls=style, label=label, mfc="none")
    for axis, quantity in zip(axes, ("state", "electrical energy"), strict=True):
        axis.axhline(ERROR, color="#666666", lw=1.0, ls=":")
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlabel("CPU time of one arm's simulated second (ms)")
        axis.set_ylabel(f"relative error of the {quantity} (-)")
        axis.xaxis.set_major_formatter(lambda value, _: f"{value:,.10g}")
    fig.suptitle("Ten-joint arm without elbows, random voltages held for 20 ms; longest steps on the left", fontsize=9)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    fig.savefig(path)
    plt.close(fig)


def _label(row: Row) -> str:
    who = row.contender
    plain = who.unit == RK4_STEP and who.family not in {MUJOCO, OURS}
    kind = "" if plain else f", {who.unit.removesuffix(' step')}"
    return f"{who.family}{kind}\n{who.name}" if who.family == PAPER else f"{who.family}{kind}, {who.name}"

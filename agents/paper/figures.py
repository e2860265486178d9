"""Figures 1 to 25 of the paper, panel by panel, one overview of them, and the series that they draw."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.evaluation.recording import Recording, thinned
from agents.files import write_csv, write_whole
from agents.style import TARGET_COLOUR, elbow_colour, elbow_name, pyplot

Array = NDArray[np.float64]
Cases = Mapping[int, Recording]
"""Recordings of one arm by elbow count, largest first, down to 0."""

# Joint 1 has reached the circle by then [s]; what it spends before dwarfs everything after.
SETTLED = 2.0
VIEWS = ((0, 1), (0, 2), (1, 2))
LEAST_SIDE = 0.3
"""Shorter side of a view over the longer one at least [-], where the hand keeps a height."""
SERIES_PERIOD = 0.01
"""Time between rows of the series [s]."""


def figures(cases: Cases) -> Iterator[tuple[str, Any]]:
    """Name and matplotlib figure of each of the paper's figures in turn, then of the overview; the caller closes it."""
    for number, axes in enumerate(VIEWS, start=1):
        yield f"fig{number:02d}", _trajectories(cases, number, axes)
    yield "fig04", _course(cases, "Fig. 4: link work, all links", work_of(None), split=True)
    yield "fig05", _course(cases, "Fig. 5: electrical energy, all motors", energy_of(None), split=True)
    for joint in range(1, cases[0].q.shape[2] + 1):
        number = 4 + 2 * joint
        yield f"fig{number:02d}", _course(cases, f"Fig. {number}: work of link {joint}", work_of(joint))
        yield (
            f"fig{number + 1:02d}",
            _course(
                cases, f"Fig. {number + 1}: electrical energy of motor {joint}", energy_of(joint), split=joint == 1
            ),
        )
    yield "paper_cases", _overview(cases)


def draw(cases: Cases, output: Path, progress: Callable[[], Any] | None = None) -> list[Path]:
    """Writes every figure as a PNG into the folder `output`, calling `progress` after each."""
    paths = []
    for name, figure in figures(cases):
        paths.append(write_whole(output / f"{name}.png", figure.savefig))
        pyplot().close(figure)
        if progress is not None:
            progress()
    return paths


def work_of(joint: int | None) -> Callable[[Recording], Array]:
    """The link work against time [J], (T + 1,), of a joint, or of all."""
    return lambda run: run.link_work[:, 0].sum(axis=-1) if joint is None else run.link_work[:, 0, joint - 1]


def energy_of(joint: int | None) -> Callable[[Recording], Array]:
    """The electrical energy against time [J], (T + 1,), of a joint, or of all."""
    return lambda run: (
        run.electrical_energy[:, 0].sum(axis=-1) if joint is None else run.electrical_energy[:, 0, joint - 1]
    )


def _trajectories(cases: Cases, number: int, axes: tuple[int, int]) -> Any:
    first, second = axes
    # Equal scales make the views along the table wide and low: there the panels lie one above the other.
    n, third = len(cases), len(cases) / 3.0
    shape, size = {
        1: ((1, n), (8.6 * third, 1.3 + 2.5 * _proportion(cases, axes))),
        2: ((n, 1), (5.6, 8.2 * third)),
        3: ((n, 1), (7.6, 6.9 * third)),
    }[number]
    fig, panels = pyplot().subplots(*shape, figsize=size, sharex=True, sharey=True, layout="constrained")
    for panel, elbows in zip(panels, cases, strict=True):
        _follow(panel, cases[elbows], axes, elbows)
        panel.plot(*cases[elbows].hand[0, 0, axes], "o", mfc="none", mec=TARGET_COLOUR, ms=6, label="start")
        panel.set_title(elbow_name(elbows), color=elbow_colour(elbows), fontweight="bold")
        panel.set(aspect="equal", xlabel=f"{'xyz'[first]} [m]", ylabel=f"{'xyz'[second]} [m]")
        panel.label_outer()
        if number == 1:
            zoom = panel.inset_axes((0.04, 0.06, 0.62, 0.36))
            _follow(zoom, cases[elbows], axes, elbows, SETTLED)
            center, radius = _extent(cases[elbows], axes)
            limits = [(middle - 1.15 * radius, middle + 1.35 * radius) for middle in center]
            zoom.set(aspect="equal", xticks=(), yticks=(), xlim=limits[0], ylim=limits[1])
            zoom.text(*center, f"t > {SETTLED:g} s", ha="center", fontsize=7)
            zoom.spines[:].set_visible(True)
    fig.suptitle(f"Fig. {number}: the hand, {'xyz'[first]}-{'xyz'[second]} plane, 0 to {cases[0].time[-1]:g} s")
    fig.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return fig


def _proportion(cases: Cases, axes: tuple[int, int]) -> float:
    """Height of what a view shows over its width [-], no less than 0.5 and no more than 2."""
    points = np.concatenate([part[:, 0][:, axes] for run in cases.values() for part in (run.hand, run.target)])
    width, height = np.ptp(points, axis=0)
    return float(np.clip(height / width, 0.5, 2.0))


def _extent(run: Recording, axes: tuple[int, int]) -> tuple[Array, float]:
    """Middle of the target's path in a view [m], (2,), and half of its longer side [m]."""
    low, high = (limit(run.target[:, 0][:, axes], axis=0) for limit in (np.min, np.max))
    return (low + high) / 2.0, float((high - low).max()) / 2.0


def _follow(panel: Any, run: Recording, axes: tuple[int, int], elbows: int, since: float = 0.0) -> None:
    """The hand from `since` on under the whole target, which stays visible on top of it."""
    late = run.time >= since - 1e-9
    panel.plot(*run.hand[late, 0][:, axes].T, color=elbow_colour(elbows), lw=1.6)
    panel.plot(*run.target[:, 0, axes].T, color=TARGET_COLOUR, lw=0.8, label="target")


def _course(cases: Cases, title: str, course: Callable[[Recording], Array], split: bool = False) -> Any:
    """Curves of the cases against time; split: beside them the same counted from `SETTLED` on."""
    fig, panels = pyplot().subplots(
        1, 2 if split else 1, figsize=(9.0 if split else 5.6, 3.6), layout="constrained", squeeze=False
    )
    _curves(panels[0, 0], cases, course)
    if split:
        _curves(panels[0, 1], cases, course, SETTLED)
    panels[0, 0].set_ylabel("work [J]" if "work" in title else "energy [J]")
    fig.suptitle(title)
    fig.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return fig


def _curves(panel: Any, cases: Cases, course: Callable[[Recording], Array], since: float = 0.0) -> None:
    for elbows, run in cases.items():
        late = run.time >= since - 1e-9
        values = course(run)[late]
        # Where curves coincide the lower one still shows at the edges of the upper.
        width = 1.4 + elbows + 0.1 * elbows**2
        panel.plot(run.time[late], values - values[0], color=elbow_colour(elbows), lw=width, label=elbow_name(elbows))
    panel.set_xlabel("time [s]")
    panel.set_xlim(since, cases[0].time[-1])
    if since:
        panel.set_title(f"counted from t = {since:g} s")


def _overview(cases: Cases) -> Any:
    """Above, the hand in three views for every case; below, what it costs."""
    # A row is cut into as many columns as both a panel for each case and three panels need.
    columns = math.lcm(len(cases), 3)
    rows = [[f"{row} {elbows}" for elbows in cases for _ in range(columns // len(cases))] for row in range(3)]
    costs = [str(k) for k in range(3) for _ in range(columns // 3)]
    fig, grid = pyplot().subplot_mosaic([*rows, costs], figsize=(9.0, 10.6), layout="constrained")
    for row, axes in enumerate(VIEWS):
        first, second = axes
        panels = [grid[f"{row} {elbows}"] for elbows in cases]
        for panel, elbows in zip(panels, cases, strict=True):
            _follow(panel, cases[elbows], axes, elbows, SETTLED)
            panel.set(aspect="equal", xlabel=f"{'xyz'[first]} [m]")
            if row == 0:
                panel.set_title(elbow_name(elbows), color=elbow_colour(elbows), fontweight="bold")
        _share_limits(panels)
        panels[0].set_ylabel(f"{'xyz'[second]} [m]")
    for key, course, since, title in zip(
        "012",
        (energy_of(None), energy_of(None), work_of(None)),
        (0.0, SETTLED, 0.0),
        ("electrical energy [J]", f"energy from t = {SETTLED:g} s on [J]", "link work [J]"),
        strict=True,
    ):
        _curves(grid[key], cases, course, since)
        grid[key].set_title(title)
        if "work" not in title:
            _label_ends(grid[key])
    lines = grid["0"].get_lines()
    target = grid[f"0 {max(cases)}"].get_lines()[-1]
    fig.legend([*lines, target], [*map(elbow_name, cases), "target"], loc="outside lower center", ncols=len(cases) + 1)
    fig.suptitle(f"The hand for t > {SETTLED:g} s, in three views, and what the run costs")
    return fig


def _share_limits(panels: Any) -> None:
    """Gives panels common limits, whose shorter side is at least `LEAST_SIDE` of the longer one."""
    x, y = np.array([[panel.get_xlim(), panel.get_ylim()] for panel in panels]).transpose(1, 0, 2)
    low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()])
    side = np.maximum(high - low, LEAST_SIDE * (high - low).max())
    low, high = (low + high - side) / 2.0, (low + high + side) / 2.0
    for panel in panels:
        panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))


def _label_ends(panel: Any) -> None:
    """Writes right of each curve's end what it comes to."""
    for line in panel.get_lines():
        end = line.get_xdata()[-1], line.get_ydata()[-1]
        panel.annotate(
            f"{end[1]:.0f}" if abs(end[1]) >= 10.0 else f"{end[1]:.2g}",
            end,
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            color=line.get_color(),
            fontweight="bold",
            annotation_clip=False,
        )


def write_series(path: Path, cases: Cases) -> Path:
    """Writes a CSV row per case and `SERIES_PERIOD`; cells of elbows that a case does not have are empty."""
    joints = range(1, cases[0].q.shape[2] + 1)
    elbows_of_all = cases[max(cases)].settings.elbow_joints
    header = [
        "elbows",
        "time [s]",
        *(f"{what}_{axis} [m]" for what in ("hand", "target") for axis in "xyz"),
        *(f"link_work_{joint} [J]" for joint in joints),
        *(f"electrical_energy_{joint} [J]" for joint in joints),
        *(f"elbow_force_{joint} [N]" for joint in elbows_of_all),
    ]

    def rows() -> Iterator[list[Any]]:
        for elbows, whole in cases.items():
            run = thinned(whole, SERIES_PERIOD)
            columns = (run.hand, run.target, run.link_work, run.electrical_energy, run.elbow_force)
            block = np.column_stack([run.time, *(column[:, 0] for column in columns)])
            missing = [""] * (len(elbows_of_all) - len(run.settings.elbow_joints))
            for row in block:
                yield [elbows, *(f"{value:.7g}" for value in row), *missing]

    return write_csv(path, header, rows())

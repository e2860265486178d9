"""Data inside the page: every run's series as a compressed block, and the data of the plots."""

from __future__ import annotations

import base64
import csv
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.evaluation.metrics import REGIMES
from agents.evaluation.players import TABLE
from agents.evaluation.recording import Recording
from agents.paper.figures import SETTLED, VIEWS
from agents.paper.numbers import PUBLISHED_CASES
from agents.report.runs import Run
from agents.style import ELBOW_NAMES, look
from elbow_gym.kinematics import joint_positions

BEARINGS = {**{str(elbows): ELBOW_NAMES[elbows] for elbows in PUBLISHED_CASES}, TABLE: "table that cannot pull"}
"""Words of the page for what an arm leans on, by its key."""
LENGTH_UNIT = 1e-4
"""Unit of the joints' positions in the page [m]; the hand's, which errors are taken from, are in full."""


def fields(run: Run) -> dict[str, NDArray[np.generic]]:
    """A run's series as the page holds them, (T + 1, ...): little-endian float32 in SI units, joints in LENGTH_UNIT.

    `power` is each joint's mean electrical power since the instant before [W], zero at the first; `joints` holds
    joints 1..n. The link work is there for the paper's PD without a limit, whose figures show it.
    """
    series = run.series
    series_period = series.time[1]
    held = {
        "hand": series.hand[:, 0],
        "target": series.target[:, 0],
        "power": _rate(series.electrical_energy[:, 0], series_period),
    }
    if series.elbow_force.shape[2]:
        held["force"] = series.elbow_force[:, 0]
    if run.controller == "pd_paper" and run.start == "paper":
        held["work"] = series.link_work[:, 0]
    blocks: dict[str, NDArray[np.generic]] = {name: values.astype("<f4") for name, values in held.items()}
    joints = joint_positions(series.settings.parsed_arm, series.q[:, 0])[:, :-1]
    blocks["joints"] = np.round(joints / LENGTH_UNIT).astype("<i2")
    return blocks


def _rate(meter: NDArray[np.float64], period: float) -> NDArray[np.float64]:
    return np.diff(meter, axis=0, prepend=meter[:1]) / period


def packed(run: Run) -> dict[str, Any]:
    """A run for the page: its name, its fields' shapes and, deflated and in base64, their bytes one after another."""
    blocks = fields(run)
    raw = b"".join(block.tobytes() for block in blocks.values())
    return {
        "controller": run.controller,
        "bearing": run.bearing,
        "start": run.start,
        "period": float(run.series.time[1]),
        "elbowJoints": list(run.series.settings.elbow_joints),
        "figures": {
            regime: {name: _plain(value) for name, value in values.items()} for regime, values in run.figures.items()
        },
        "fields": [[name, block.dtype.str[1:], list(block.shape)] for name, block in blocks.items()],
        "data": base64.b64encode(zlib.compress(raw, 9)).decode("ascii"),
    }


def _plain(value: float) -> float | None:
    """Numbers as JSON has them: None where they are NaN."""
    return None if np.isnan(value) else float(f"{value:.6g}")


def payload(runs: Sequence[Run], results: Path) -> dict[str, Any]:
    """All of the page's data, JSON types only."""
    controllers = {run.controller: run.label or look(run.controller)[0] for run in runs}
    shown = {run.bearing for run in runs}
    longest = max(runs, key=lambda run: run.series.time[-1])
    return {
        "runs": {run.key: packed(run) for run in runs},
        "lengthUnit": LENGTH_UNIT,
        "duration": float(longest.series.time[-1]),
        "settled": SETTLED,
        "controllers": {name: {"name": label, "marker": look(name)[2]} for name, label in controllers.items()},
        "bearings": [[name, title] for name, title in BEARINGS.items() if name in shown],
        "regimes": {
            regime.name: {"start": regime.start, "since": regime.since, "meaning": regime.meaning} for regime in REGIMES
        },
        "front": front(results / "optimal.csv"),
        "panels": panels(longest.series),
    }


def panels(series: Recording) -> list[dict[str, Any]]:
    """Figures of the paper in order: number, title, kind and series."""
    drawn: list[dict[str, Any]] = []
    for number, (first, second) in enumerate(VIEWS, start=1):
        plane = f"{'xyz'[first]}-{'xyz'[second]}"
        drawn.append({"number": number, "title": f"The hand, {plane} plane", "kind": "plane", "axes": [first, second]})
    drawn.append({"number": 4, "title": "Link work, all links", "kind": "work"})
    drawn.append({"number": 5, "title": "Electrical energy, all motors", "kind": "energy"})
    for joint in range(1, series.q.shape[2] + 1):
        number = 4 + 2 * joint
        drawn.append({"number": number, "title": f"Work of link {joint}", "kind": "work", "joint": joint})
        drawn.append(
            {"number": number + 1, "title": f"Electrical energy of motor {joint}", "kind": "energy", "joint": joint}
        )
    return drawn


def front(path: Path) -> list[dict[str, Any]]:
    """Solved problems of the bound: elbows, start, energy weight, mean error [mm] and energy [J]; none without file.

    Problems in which the arm may go under the table are no points of the front.
    """
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as handle:
        return [
            {
                "bearing": row["elbows"],
                "start": row["start"],
                "weight": float(row["energy_weight"]),
                "error": 1e3 * float(row["error_mean"]),
                "energy": float(row["energy"]),
            }
            for row in csv.DictReader(handle)
            if row["status"] == "solved" and row["under"] == "False"
        ]

"""How a policy is judged while it trains, and the rows of evaluations.csv."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from agents.evaluation.metrics import metrics
from agents.evaluation.recording import record
from agents.files import write_csv
from elbow_gym.baselines.policy import Policy
from elbow_gym.task.settings import Settings

EVALUATION_SEEDS = tuple(range(10_000, 10_008))
"""Seeds that choose the best policy while it trains; the benchmark's own seeds are others."""


RANDOM_EVALUATION_SEEDS = tuple(range(10_000, 10_032))
"""The same where arms and circles are drawn, and eight would be few."""


COLUMNS = {
    "steps": "-",
    "training_seconds": "s",
    "wall_seconds": "s",
    "return": "-",
    "electrical_energy": "J",
    "drawn_energy": "J",
    "steady_electrical_energy": "J",
    "steady_error_rms_mm": "mm",
    "error_mean_mm": "mm",
}
"""Of evaluations.csv: control periods, time that the training took without evaluations and checkpoints, time in all,
and `evaluation`."""


def evaluation_seeds(settings: Settings) -> tuple[int, ...]:
    """The seeds of an environment's evaluations."""
    drawn = settings.randomization.ranges or settings.parsed_circle.random
    return RANDOM_EVALUATION_SEEDS if drawn else EVALUATION_SEEDS


def evaluation(policy: Policy, settings: Settings) -> dict[str, float]:
    """Means over the evaluation seeds, by name; "steady" counts the last 60 % of the episode, 2-5 s by default."""
    recording = record(settings, lambda _: policy, evaluation_seeds(settings))
    whole, steady = metrics(recording), metrics(recording, 0.4 * recording.time[-1])
    return {
        "return": float(whole["return"].mean()),
        "electrical_energy": float(whole["electrical_energy"].mean()),
        "drawn_energy": float(whole["drawn_energy"].mean()),
        "steady_electrical_energy": float(steady["electrical_energy"].mean()),
        "steady_error_rms_mm": float(np.sqrt((steady["error_rms"] ** 2).mean())),
        "error_mean_mm": float(whole["error_mean"].mean()),
    }


def evaluation_row(steps: int, training: float, wall: float, figures: Mapping[str, float]) -> list[float]:
    """A row of evaluations.csv in the order of `COLUMNS`, from control periods, both kinds of seconds and figures."""
    row = {"steps": steps, "training_seconds": training, "wall_seconds": wall, **figures}
    return [float(row[name]) for name in COLUMNS]


def sentence(figures: Mapping[str, float]) -> str:
    """The evaluation's figures in a line."""
    return (
        f"return {figures['return']:.2f}, {figures['electrical_energy']:.1f} J in all, "
        f"{figures['steady_electrical_energy']:.1f} J and {figures['steady_error_rms_mm']:.2f} mm rms when steady"
    )


def write_evaluations(folder: Path, rows: Sequence[Sequence[float]]) -> None:
    """Writes `folder`/evaluations.csv whole; rows hold `COLUMNS`."""
    header = [f"{name} [{unit}]" for name, unit in COLUMNS.items()]
    write_csv(folder / "evaluations.csv", header, ([f"{value:.10g}" for value in row] for row in rows))


def read_evaluations(folder: Path, last: int) -> list[list[float]]:
    """The rows of `folder`/evaluations.csv up to `last` control periods; later ones are measured again."""
    path = folder / "evaluations.csv"
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as handle:
        rows = [[float(cell) for cell in row] for row in list(csv.reader(handle))[1:]]
    return [row for row in rows if row[0] <= last]

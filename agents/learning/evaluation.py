"""Evaluation of a policy during its training: seeds, metrics and the columns of a run's evaluations."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from agents.evaluation.metrics import metrics
from agents.evaluation.players import Maker
from agents.evaluation.recording import record
from elbow_gym.baselines.policy import Policy
from elbow_gym.task.settings import Settings

EVALUATION_SEEDS = tuple(range(10_000, 10_008))
"""Seeds of the evaluations that choose the best policy; the benchmark's seeds are others."""
RANDOM_EVALUATION_SEEDS = tuple(range(10_000, 10_032))
"""Seeds of the evaluations in environments that draw arms or circles, of which eight would be few."""
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
"""Names and units of an evaluation's row: control periods of the training, its time without evaluations and
checkpoints, its time in all, and the means of `evaluation`."""


def evaluation_seeds(settings: Settings) -> tuple[int, ...]:
    """Seeds of an environment's evaluations."""
    drawn = settings.randomization.ranges or settings.parsed_circle.random
    return RANDOM_EVALUATION_SEEDS if drawn else EVALUATION_SEEDS


def evaluation(policy: Policy, settings: Settings) -> dict[str, float]:
    """Metrics of a policy during its training, by name, as `controller_evaluation` gives them."""
    return controller_evaluation(policy.acting_in, settings)


def controller_evaluation(make: Maker, settings: Settings) -> dict[str, float]:
    """Means over the evaluation seeds, by name; "steady" counts the last 60 % of the episode, 2-5 s by default.

    Args:
        make: gives the controller for an environment with these settings.
        settings: arguments of the environment.
    """
    recording = record(settings, make, evaluation_seeds(settings))
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
    """Row of `COLUMNS`.

    Args:
        steps: control periods of the training.
        training: time of the training without evaluations and checkpoints [s].
        wall: time of the training in all [s].
        figures: what `evaluation` returned.
    """
    row = {"steps": steps, "training_seconds": training, "wall_seconds": wall, **figures}
    return [float(row[name]) for name in COLUMNS]


def sentence(figures: Mapping[str, float]) -> str:
    """Line for the terminal from what `evaluation` returned."""
    return (
        f"return {figures['return']:.2f}, {figures['electrical_energy']:.1f} J in all, "
        f"{figures['steady_electrical_energy']:.1f} J and {figures['steady_error_rms_mm']:.2f} mm rms when steady"
    )

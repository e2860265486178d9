"""Metrics of one player in the regimes A, B and C, and their report on the terminal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.evaluation.metrics import REGIMES, UNITS, Regime, joint_energies, metrics
from agents.evaluation.players import Player
from agents.evaluation.recording import Recording, record_starts

BENCHMARK_SEEDS = tuple(range(20_000, 20_020))
"""Seeds of the benchmark's start poses: fixed and public; no training and no choice of a policy uses them."""

SHIFTED: dict[str, Any] = {
    "start_noise": 0.04,
    "circle": {"radius": [0.05, 0.1], "period": [3.5, 7.0], "phase": "random"},
    "randomize": {"payload": [0.05, 0.2]},
}
"""Arguments of the environment in the shifted set. No training and no tuning has used it; controllers know the
circle and not the payload. Larger circles are out of the paper PD's reach."""

RECORDING_PERIOD = 0.001
"""Time between two recorded instants of a fast controller [s]; slower ones are recorded at their own rate."""

Results = dict[str, dict[str, NDArray[np.float64]]]


def recordings(
    player: Player,
    starts: Sequence[str],
    seeds: Sequence[int],
    progress: Callable[[int, int], None] | None = None,
    period: float = RECORDING_PERIOD,
) -> dict[str, Recording]:
    """A player's episodes from each start, side by side where it can, else one start after the other.

    Args:
        player: the player.
        starts: values of the environment's `start`.
        seeds: one per episode, the same for every start.
        progress: called with the control periods done and in all, of all starts together.
        period: time between two recorded instants [s], a control period at least.
    """
    every = max(1, round(player.settings.control_frequency * period))
    batches = [tuple(starts)] if player.starts_together else [(start,) for start in starts]
    played: dict[str, Recording] = {}
    for number, batch in enumerate(batches):

        def tell(done: int, horizon: int, number: int = number) -> None:
            if progress is not None:
                progress(number * horizon + done, len(batches) * horizon)

        settings = replace(player.settings, start=batch[0])
        played.update(record_starts(settings, batch, player.make, seeds, tell, every))
    return played


def in_all_regimes(
    player: Player,
    seeds: Sequence[int] = BENCHMARK_SEEDS,
    progress: Callable[[int, int], None] | None = None,
    regimes: Sequence[Regime] = REGIMES,
) -> Results:
    """Metrics of every episode (S,) by regime and name; `joint_energy` beside them is (S, n).

    Regimes with the same start share their episodes; a player that can takes all starts side by side.

    Args:
        player: the player.
        seeds: one per episode.
        progress: called with the control periods done and in all, of all starts together.
        regimes: regimes to count.
    """
    starts = tuple(dict.fromkeys(regime.start for regime in regimes))
    played = recordings(player, starts, seeds, progress)
    results: Results = {}
    for regime in regimes:
        recording = played[regime.start]
        results[regime.name] = metrics(recording, regime.since)
        results[regime.name]["joint_energy"] = joint_energies(recording, regime.since)
    return results


def print_results(title: str, results: Results) -> None:
    """A table on the terminal: one row per metric, one column per regime, mean and standard deviation."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title)
    table.add_column("metric")
    table.add_column("unit")
    for regime in REGIMES:
        table.add_column(f"{regime.name}: {regime.meaning.split(':')[0]}", justify="right")
    for name, unit in UNITS.items():
        cells = [f"{results[r.name][name].mean():.4g} ± {results[r.name][name].std():.2g}" for r in REGIMES]
        table.add_row(name.replace("_", " "), unit, *cells)
    Console().print(table)

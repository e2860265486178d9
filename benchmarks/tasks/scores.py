"""Scores on the evaluation tasks: how far players stay from every optimum, and what disturbances cost them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agents.evaluation.interquartile import Estimate, interquartile_mean, quantile
from benchmarks.tasks.contenders import PD, Contender
from benchmarks.tasks.episodes import NOMINAL, UNITS

Array = NDArray[np.float64]
Key = tuple[int, int]
Episodes = Mapping[tuple[Contender, str], Mapping[int, Mapping[str, float]]]
"""Figures of episodes by contender and disturbance, then by the task's number."""


@dataclass(frozen=True)
class Score:
    """A player's score at an elbow count, over all of its training seeds and all tasks that are solved."""

    name: str
    elbows: int
    gaps: Array
    """(J - J_opt) / J_opt with J = -return [-], (seeds, tasks)."""
    share: float
    """Share of the gain from the PD to the optimum, median [-]; of the tasks that the PD plays to their end."""
    energy: float
    """Electrical energy of an episode, median [J]."""
    error: float
    """Tracking error from 2 s on, root mean square, median [mm]."""
    below: float
    """Time that a joint or the hand spends under the table in an episode, mean [s]."""
    failures: int
    """Episodes that were refused, ended early, or cost more than the PD's of the same task."""
    losses: Mapping[str, Estimate]
    """Median increase of the cost by each disturbance that it played under, as a share of the optimum's cost [-]."""

    @property
    def median(self) -> Estimate:
        """Median gap [-]."""
        return quantile(self.gaps, 0.5)

    @property
    def middle(self) -> Estimate:
        """Interquartile mean of the gaps [-]."""
        return interquartile_mean(self.gaps)

    @property
    def tail(self) -> Estimate:
        """90th percentile of the gaps [-]."""
        return quantile(self.gaps, 0.9)


def scores(episodes: Episodes, optima: Mapping[Key, Mapping[str, float]]) -> list[Score]:
    """Scores by elbow count, most first, and then by median gap; tasks without an optimum are left out."""
    found = []
    for elbows in sorted({contender.elbows for contender, _ in episodes}, reverse=True):
        numbers = sorted(number for count, number in optima if count == elbows)
        if not numbers:
            continue
        mine = {key: of for key, of in episodes.items() if key[0].elbows == elbows}
        best = np.array([optima[elbows, number]["cost"] for number in numbers])
        names = dict.fromkeys(contender.name for contender, _ in mine)
        arrays = {name: _arrays(mine, name, numbers) for name in names}
        of_count = [_score(name, elbows, arrays[name], arrays[PD], best) for name in names]
        found += sorted(of_count, key=lambda one: one.median.value)
    return found


def _arrays(episodes: Episodes, name: str, numbers: Sequence[int]) -> dict[str, dict[str, Array]]:
    """Figures of a player by disturbance and name, (seeds, tasks)."""
    found: dict[str, dict[str, Array]] = {}
    for disturbance in dict.fromkeys(key[1] for key in episodes):
        seeds = [of for (one, way), of in episodes.items() if (one.name, way) == (name, disturbance)]
        if not seeds:
            continue
        found[disturbance] = {
            figure: np.array([[of[number][figure] for number in numbers] for of in seeds]) for figure in UNITS
        }
    return found


def _score(
    name: str, elbows: int, mine: Mapping[str, Mapping[str, Array]], pd: Mapping[str, Mapping[str, Array]], best: Array
) -> Score:
    known, (price,) = mine[NOMINAL], pd[NOMINAL]["cost"]
    cost, whole = known["cost"], pd[NOMINAL]["complete"][0] > 0.0
    share = (price - cost)[:, whole] / (price - best)[whole]
    failed = (known["complete"] == 0.0) | (cost > price)
    return Score(
        name,
        elbows,
        gaps=cost / best - 1.0,
        share=float(np.median(share)) if share.size else float("nan"),
        energy=float(np.median(known["energy"])),
        error=float(np.median(known["error_rms"])),
        below=float(known["below_table"].mean()),
        failures=int(failed.sum()),
        losses={way: quantile((of["cost"] - cost) / best, 0.5) for way, of in mine.items() if way != NOMINAL},
    )

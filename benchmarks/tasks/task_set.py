"""Sets of fifty tasks of `ElbowArmTasks-v0`: the evaluation tasks, and those of any other seeds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

from elbow_gym.suite import EVALUATION_SEEDS, FIRST_SEED, evaluation_tasks


@dataclass(frozen=True)
class TaskSet:
    """As many tasks for each elbow count as there are evaluation tasks, from seeds that follow each other."""

    first_seed: int = FIRST_SEED
    """Seed of the first task; the evaluation's by default."""

    @property
    def name(self) -> str:
        """Beginning of the names of the set's files."""
        return "tasks" if self.first_seed == FIRST_SEED else f"tasks_{self.first_seed}"

    def numbered(self, elbows: int) -> dict[int, dict[str, Any]]:
        """The tasks of an elbow count by their numbers from 0 on, as options of a reset.

        Raises:
            ValueError: the seed is negative, or elbows is not 0, 1 or 2.
        """
        return _numbered(elbows, self.first_seed)


EVALUATION = TaskSet()
"""The evaluation tasks."""


@cache
def _numbered(elbows: int, first_seed: int) -> dict[int, dict[str, Any]]:
    return dict(enumerate(evaluation_tasks(elbows, range(first_seed, first_seed + len(EVALUATION_SEEDS)))))

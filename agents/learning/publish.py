"""Publication of finished training runs in the project: their best policies and their learning curves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from agents.learning.run_folder import RunFolder
from agents.policy import SHIPPED
from agents.tasks import task_name

CURVES = Path(__file__).parents[2] / "benchmarks" / "results" / "learning"
LARGEST = 300_000
"""Largest size of a shipped policy's two files together [B]."""


def publish(
    runs: Sequence[Path], policies: Path = SHIPPED, curves: Path = CURVES, replace_seeds: bool = False
) -> list[str]:
    """Copies the best policy and evaluations.csv of every run; nothing is written unless all can be.

    Args:
        runs: folders of finished runs, named ALGORITHM[_LABEL]_TASK_seedK as the training names them.
        policies: folder of the policies.
        curves: folder of the curves.
        replace_seeds: remove the shipped seeds of the same algorithm and task that are not among `runs`.

    Returns:
        The names of the policies that were published.

    Raises:
        ValueError: there are no runs, or a run is not finished, has not the name of what it holds, or holds no policy
            or too large a one.
    """
    if not runs:
        raise ValueError("runs must be at least one folder of a finished training, got none")
    folders = [RunFolder(run) for run in runs]
    names = [_checked(folder) for folder in folders]
    policies.mkdir(parents=True, exist_ok=True)
    curves.mkdir(parents=True, exist_ok=True)
    for folder, name in zip(folders, names, strict=True):
        folder.copy_best(policies / name)
        folder.copy_evaluations(curves / f"{name}.csv")
    if replace_seeds:
        groups = {name.rpartition("_seed")[0] for name in names}
        for path in [*policies.iterdir(), *curves.iterdir()]:
            if path.stem.rpartition("_seed")[0] in groups and path.stem not in names:
                path.unlink()
    return names


def _checked(folder: RunFolder) -> str:
    """The run's name, if it may be published."""
    result, policy = folder.result(), folder.best()
    if result is None or not result["finished"]:
        raise ValueError(f"runs must be finished trainings, got {folder.path}")
    if policy is None:
        raise ValueError(f"runs must hold a best policy, got none in {folder.path}")
    card, name = policy.card, folder.name
    task = task_name(card.env, card.environment["elbows"])
    ends = f"_{task}_seed{card.training['seed']}"
    if not (name.startswith(card.algorithm) and name.endswith(ends)):
        raise ValueError(f"runs must be named {card.algorithm}[_LABEL]{ends} as what they hold, got {name}")
    if folder.best_size() > LARGEST:
        raise ValueError(f"a policy must have at most {LARGEST} bytes, got {folder.best_size()} in {folder.path}")
    return name

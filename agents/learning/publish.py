"""Takes finished training runs over into the project: their best policies and their learning curves."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

from agents.files import write_whole
from agents.policy import SHIPPED, load_policy, pair
from agents.tasks import task_name

CURVES = Path(__file__).parents[2] / "benchmarks" / "results" / "learning"
LARGEST = 300_000
"""Of a shipped policy's two files together [B]."""


def publish(
    runs: Sequence[Path], policies: Path = SHIPPED, curves: Path = CURVES, replace_seeds: bool = False
) -> list[str]:
    """Copies the best policy and evaluations.csv of every run; nothing is written unless all can be.

    Args:
        runs: folders of finished runs, named ALGORITHM[_LABEL]_TASK_seedK as the training names them.
        policies: where the policies go.
        curves: where the curves go.
        replace_seeds: remove the shipped seeds of the same algorithm and task that are not among `runs`.

    Returns:
        The names of what was published.

    Raises:
        ValueError: a run is not finished, or has not the name of what it holds, or its policy is too large.
    """
    names = [_checked(run) for run in runs]
    policies.mkdir(parents=True, exist_ok=True)
    curves.mkdir(parents=True, exist_ok=True)
    for run, name in zip(runs, names, strict=True):
        # The card last: it is what makes a policy be found.
        for source, target in reversed(list(zip(pair(run / "best"), pair(policies / name), strict=True))):
            _copy(source, target)
        _copy(run / "evaluations.csv", curves / f"{name}.csv")
    if replace_seeds:
        groups = {name.rpartition("_seed")[0] for name in names}
        for path in [*policies.iterdir(), *curves.iterdir()]:
            if path.stem.rpartition("_seed")[0] in groups and path.stem not in names:
                path.unlink()
    return names


def _copy(source: Path, target: Path) -> None:
    write_whole(target, lambda temporary: shutil.copyfile(source, temporary))


def _checked(run: Path) -> str:
    """The run's name, if it may be published."""
    result = run / "result.json"
    if not result.is_file() or not json.loads(result.read_text(encoding="utf-8"))["finished"]:
        raise ValueError(f"runs must be finished trainings, got {run}")
    card, name = load_policy(run / "best").card, run.resolve().name
    task = task_name(card.env, card.environment["elbows"])
    ends = f"_{task}_seed{card.training['seed']}"
    if not (name.startswith(card.algorithm) and name.endswith(ends)):
        raise ValueError(f"runs must be named {card.algorithm}[_LABEL]{ends} as what they hold, got {name}")
    size = sum(path.stat().st_size for path in pair(run / "best"))
    if size > LARGEST:
        raise ValueError(f"a policy must have at most {LARGEST} bytes, got {size} in {run}")
    return name

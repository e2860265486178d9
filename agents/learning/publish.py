"""Takes finished training runs over into the project: their best policies and their learning curves."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

from agents.files import write_whole
from agents.shipped import CURVES, POLICIES
from elbow_gym.baselines.policy import BASELINES, pair, read_policy
from elbow_gym.baselines.tasks import task_name

LARGEST = 300_000
"""Of a shipped policy's two files together [B]."""


def publish(
    runs: Sequence[Path],
    replace_seeds: bool = False,
    baselines: Path = BASELINES,
    policies: Path = POLICIES,
    curves: Path = CURVES,
) -> list[str]:
    """Copies the best policy and evaluations.csv of every run; nothing is written unless all can be.

    Args:
        runs: folders of finished runs, named ALGORITHM[_LABEL]_TASK_seedK as the training names them.
        replace_seeds: remove the shipped seeds of the same algorithm and task that are not among `runs`.
        baselines: where the best seed of each algorithm and task goes.
        policies: where the other seeds go.
        curves: where the curves go.

    Returns:
        The names of what was published.

    Raises:
        ValueError: a run is not finished, or has not the name of what it holds, or its policy is too large.
    """
    names = [_checked(run) for run in runs]
    groups = {name.rpartition("_seed")[0] for name in names}
    for folder in (baselines, policies, curves):
        folder.mkdir(parents=True, exist_ok=True)
    for run, name in zip(runs, names, strict=True):
        _copy_policy(run / "best", policies / name)
        _remove_policy(baselines / name)
        _copy(run / "evaluations.csv", curves / f"{name}.csv")
    if replace_seeds:
        for path in (path for folder in (baselines, policies, curves) for path in folder.iterdir()):
            if path.stem.rpartition("_seed")[0] in groups and path.stem not in names:
                path.unlink()
    for group in groups:
        _choose_baseline(group, baselines, policies)
    return names


def _choose_baseline(group: str, baselines: Path, policies: Path) -> None:
    """Moves the seed with the best return at its evaluation to the baselines, and the others away from there."""
    cards = [path for folder in (baselines, policies) for path in folder.glob(f"{group}_seed*.json")]
    merit = {path: json.loads(path.read_text(encoding="utf-8"))["evaluation"]["return"] for path in cards}
    best = max(sorted(cards, key=lambda path: int(path.stem.rpartition("_seed")[2])), key=merit.__getitem__)
    moves = [(path, policies) for path in cards if path.parent == baselines and path != best]
    moves += [(best, baselines)] if best.parent != baselines else []
    for path, folder in moves:
        _copy_policy(path, folder / path.stem)
        _remove_policy(path)


def _copy_policy(source: Path, target: Path) -> None:
    # The card last: it is what makes a policy be found.
    for old, new in reversed(list(zip(pair(source), pair(target), strict=True))):
        _copy(old, new)


def _remove_policy(path: Path) -> None:
    for file in pair(path):
        file.unlink(missing_ok=True)


def _copy(source: Path, target: Path) -> None:
    write_whole(target, lambda temporary: shutil.copyfile(source, temporary))


def _checked(run: Path) -> str:
    """The run's name, if it may be published."""
    result = run / "result.json"
    if not result.is_file() or not json.loads(result.read_text(encoding="utf-8"))["finished"]:
        raise ValueError(f"runs must be finished trainings, got {run}")
    card, name = read_policy(run / "best").card, run.resolve().name
    task = task_name(card.env, card.environment["elbows"])
    ends = f"_{task}_seed{card.training['seed']}"
    if not (name.startswith(card.algorithm) and name.endswith(ends)):
        raise ValueError(f"runs must be named {card.algorithm}[_LABEL]{ends} as what they hold, got {name}")
    size = sum(path.stat().st_size for path in pair(run / "best"))
    if size > LARGEST:
        raise ValueError(f"a policy must have at most {LARGEST} bytes, got {size} in {run}")
    return name

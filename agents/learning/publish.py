"""Publication of finished training runs in the project: their best policies and their learning curves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from agents.files import read_json
from agents.learning.actor import copy_policy
from agents.learning.run_folder import RunFolder
from agents.shipped import CURVES, POLICIES
from agents.shipped.seeds import check_name
from agents.tasks import BEST
from elbow_gym.baselines.policy import BASELINES, pair
from elbow_gym.checks import as_dict, finite

LARGEST = 300_000
"""Largest size of a shipped policy's two files together [B]."""


def publish(
    runs: Sequence[Path],
    replace_seeds: bool = False,
    allow_worse: bool = False,
    baselines: Path = BASELINES,
    policies: Path = POLICIES,
    curves: Path = CURVES,
) -> list[str]:
    """Copies the best policy and evaluations.csv of every run; nothing is written unless all can be.

    Args:
        runs: folders of finished runs, named ALGORITHM[_LABEL]_TASK_seedK as the training names them.
        replace_seeds: remove the shipped seeds of the same algorithm and task that are not among `runs`.
        allow_worse: publish also where a shipped policy gives way to one with a worse return at its evaluation.
        baselines: folder for the best seed of each algorithm and task.
        policies: folder for the other seeds.
        curves: folder for the curves.

    Returns:
        The names of the policies that were published.

    Raises:
        ValueError: there are no runs, or a run is not finished, has not the name of what it holds, or holds no policy,
            too large a one or damaged files; or a better policy would go and `allow_worse` is not set.
    """
    if not runs:
        raise ValueError("runs must be at least one folder of a finished training, got none")
    files = [RunFolder(run) for run in runs]
    names = [_checked(run) for run in files]
    groups = {name.rpartition("_seed")[0] for name in names}
    if not allow_worse:
        _check_better(files, names, replace_seeds, (baselines, policies))
    for folder in (baselines, policies, curves):
        folder.mkdir(parents=True, exist_ok=True)
    for run, name in zip(files, names, strict=True):
        run.copy_best(policies / name)
        _remove_policy(baselines / name)
        run.copy_evaluations(curves / f"{name}.csv")
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
    merit = {path: _merit(path) for path in cards}
    best = max(sorted(cards, key=lambda path: int(path.stem.rpartition("_seed")[2])), key=merit.__getitem__)
    moves = [(path, policies) for path in cards if path.parent == baselines and path != best]
    moves += [(best, baselines)] if best.parent != baselines else []
    for path, folder in moves:
        copy_policy(path, folder / path.stem)
        _remove_policy(path)


def _check_better(
    runs: Sequence[RunFolder], names: Sequence[str], replace_seeds: bool, folders: Sequence[Path]
) -> None:
    """Raises ValueError where a shipped policy would give way to one with a worse return."""
    new = {name: _merit(pair(run.path / BEST)[0]) for run, name in zip(runs, names, strict=True)}
    for path in sorted(path for folder in folders for path in folder.glob("*_seed*.json")):
        group = path.stem.rpartition("_seed")[0]
        if path.stem in new:
            reached = new[path.stem]
        elif replace_seeds and group in {name.rpartition("_seed")[0] for name in names}:
            reached = max(value for name, value in new.items() if name.rpartition("_seed")[0] == group)
        else:
            continue
        if reached < _merit(path):
            raise ValueError(
                f"return must be at least the shipped {path.stem}'s {_merit(path):.2f}, or --allow-worse be given, "
                f"got {reached:.2f}"
            )


def _merit(card: Path) -> float:
    """Return of a policy at the evaluation that chose it, from its card. Raises ValueError where there is none."""
    evaluation = as_dict(f"evaluation in {card}", read_json(card).get("evaluation"))
    return finite(f"return in {card}", evaluation.get("return"))


def _remove_policy(path: Path) -> None:
    for file in pair(path):
        file.unlink(missing_ok=True)


def _checked(folder: RunFolder) -> str:
    """The run's name, if it may be published."""
    result, policy = folder.result(), folder.best()
    if result is None or not result["finished"]:
        raise ValueError(f"runs must be finished trainings, got {folder.path}")
    if policy is None:
        raise ValueError(f"runs must hold a best policy, got none in {folder.path}")
    if not folder.evaluations():
        raise ValueError(f"runs must hold evaluations, got none in {folder.path}")
    check_name("runs", folder.name, policy.card)
    if folder.best_size() > LARGEST:
        raise ValueError(f"a policy must have at most {LARGEST} bytes, got {folder.best_size()} in {folder.path}")
    return folder.name

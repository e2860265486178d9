"""Checks of a checkout: those of elbow_gym, the shipped policies against their cards, the PD's joules."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from agents.evaluation.command import verify_receipt
from agents.evaluation.players import ELBOW_COUNTS
from agents.evaluation.receipt import player_again, read_receipt
from agents.evaluation.receipt import verify as play_again
from agents.shipped import CURVES, POLICIES, RECEIPTS
from agents.shipped.seeds import check_name
from elbow_gym import verification
from elbow_gym.baselines.policy import BASELINES, pair, read_policy


def shipped_policies(folders: Sequence[Path] = (BASELINES, POLICIES), curves: Path = CURVES) -> str:
    """Weights and card of every policy by their digest, and the card by the files' name.

    Args:
        folders: folders of pairs of files.
        curves: learning curves, one of each policy's training.

    Raises:
        ValueError: there are none, or some are wrong, missing or there twice; the message has them all.
    """
    known = {path.stem for path in curves.glob("*.csv")}
    known |= {path.stem for folder in folders for path in folder.glob("*_seed*")}
    faults = [] if known else [f"policies must be in {folders[0]}, got none"]
    for name in sorted(known):
        found = [folder / name for folder in folders if any(file.is_file() for file in pair(folder / name))]
        curve = (curves / f"{name}.csv").is_file()
        try:
            if len(found) != 1 or not curve:
                raise ValueError(f"policies and learning curves must be one and one, got {len(found)} and {int(curve)}")
            check_name("policies", name, read_policy(found[0]).card)
        except (ValueError, OSError) as error:
            faults.append(f"{name}: {error}")
    if faults:
        raise ValueError("; ".join(faults))
    return f"{len(known)} by their digests"


def joules_again(receipt: Path) -> str:
    """The episodes of a receipt, played again. Raises ValueError where they cost other joules, or it cannot be read."""
    given = read_receipt(str(receipt))
    return play_again(given, player_again(given))


CHECKS: dict[str, Callable[[], str]] = {
    **verification.CHECKS,
    "shipped policies": shipped_policies,
    **{f"PD, elbows {n}": partial(joules_again, RECEIPTS / f"pd_elbows{n}.json") for n in ELBOW_COUNTS},
}
"""Checks by name; each returns figures, or raises where something is wrong."""


def verify(receipt: str | None = None, trust: bool = False) -> bool:
    """Runs all checks and prints a line each; whether all have passed. With a receipt, plays that alone again.

    Args:
        receipt: its line or file, as `read_receipt` takes it.
        trust: whether a file that may run code when it is read may be read.

    Raises:
        ValueError: the receipt cannot be read or played, or its results differ.
    """
    if receipt is None:
        return verification.verify(CHECKS)
    verify_receipt(receipt, trust)
    return True

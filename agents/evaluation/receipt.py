"""Receipts of evaluations: one line with which anybody can play the same episodes again and compare."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from agents.evaluation.metrics import REGIMES
from agents.evaluation.player import Player
from agents.evaluation.players import find_player
from agents.evaluation.regimes import Results, in_all_regimes
from agents.machine import code, machine, versions
from agents.tasks import plain_arguments
from elbow_gym.checks import is_finite
from elbow_gym.task.settings import Settings

TOLERANCE = 1e-6
"""Largest difference of an episode's energy between machines, over the energy or 1 J, whichever is more [-]."""
PACKAGES = ("elbow-gym", "numpy", "numba", "scipy")
"""Libraries whose versions results depend on to the last bit."""
ASKED = ("what", "env", "elbows", "arguments")
KINDS: dict[str, tuple[str, tuple[type, ...]]] = {
    "what": ("a name", (str,)),
    "env": ("an id", (str,)),
    "elbows": ("a number, joints or null", (int, list, type(None))),
    "arguments": ("an object", (dict,)),
    "settings": ("an object", (dict,)),
    "seeds": ("a list", (list,)),
    "player": ("a digest", (str,)),
    "joules": ("an object", (dict,)),
    "digest": ("a digest", (str,)),
    "code": ("a digest", (str,)),
    "machine": ("an object", (dict,)),
    "versions": ("an object", (dict,)),
}
"""Entries of a receipt: what each is, and its types."""
ENTRIES = tuple(KINDS)


def receipt(asked: Mapping[str, Any], player: Player, seeds: list[int], results: Results) -> dict[str, Any]:
    """Receipt of a player's episodes, JSON types only.

    Args:
        asked: `ASKED`: the player and its environment, as `find_player` takes them.
        player: the player.
        seeds: seeds of the episodes, which were played side by side.
        results: what `in_all_regimes` gave for them.
    """
    return {
        **{name: asked[name] for name in ASKED},
        "settings": plain_arguments(player.settings),
        "seeds": seeds,
        "player": player.identity,
        "joules": {name: values["electrical_energy"].tolist() for name, values in results.items()},
        "digest": _digest(results),
        "code": code(),
        "machine": machine(),
        "versions": versions(*PACKAGES),
    }


def read_receipt(word: str) -> dict[str, Any]:
    """The receipt in a line, or in a file that holds one.

    Raises:
        ValueError: it is neither, or an entry is missing or of another kind.
    """
    try:
        # A line is too long for a file's name, and some systems say so by an error.
        text = Path(word).read_text(encoding="utf-8") if len(word) < 256 and Path(word).is_file() else word
        plain = json.loads(text)
    except (OSError, ValueError, RecursionError) as error:
        raise ValueError(
            f"receipt must be a line of `evaluate --receipt` or its file, got {word:.60}: {error}"
        ) from error
    missing = [name for name in ENTRIES if not isinstance(plain, dict) or name not in plain]
    if missing:
        raise ValueError(f"receipt must have the entries {', '.join(ENTRIES)}, got none of {', '.join(missing)}")
    for name, (rule, types) in KINDS.items():
        if not isinstance(plain[name], types) or isinstance(plain[name], bool):
            raise ValueError(f"{name} of the receipt must be {rule}, got {plain[name]!r:.60}")
    _check_seeds_and_joules(plain["seeds"], plain["joules"])
    return plain


def _check_seeds_and_joules(seeds: list[Any], joules: dict[str, Any]) -> None:
    """Raises ValueError unless there are seeds, and a number of joules for each of them in every regime."""
    if not seeds or not all(type(seed) is int and seed >= 0 for seed in seeds):
        raise ValueError(f"seeds of the receipt must be whole numbers from 0 on, at least one, got {seeds!r:.60}")
    regimes = [regime.name for regime in REGIMES]
    if sorted(joules) != sorted(regimes):
        raise ValueError(
            f"joules of the receipt must be of the regimes {', '.join(regimes)}, got {sorted(joules)!r:.60}"
        )
    for regime, values in joules.items():
        if not isinstance(values, list) or not all(type(one) in (int, float) and is_finite(one) for one in values):
            raise ValueError(f"joules of regime {regime} must be finite numbers, got {values!r:.60}")
        if len(values) != len(seeds):
            raise ValueError(f"joules of regime {regime} must be one for each seed, got {len(values)} of {len(seeds)}")


def player_again(given: Mapping[str, Any], trust: bool = False) -> Player:
    """The player of a receipt.

    Args:
        given: the receipt.
        trust: whether a file that may run code when it is read may be read.

    Raises:
        ValueError: there is no such player here, or it is another one, or plays in other settings.
    """
    elbows = tuple(given["elbows"]) if isinstance(given["elbows"], list) else given["elbows"]
    try:
        player = find_player(given["what"], elbows, given["env"], given["arguments"], trust)
    except TypeError as error:
        raise ValueError(f"arguments of the receipt must be an environment's, got {given['arguments']}") from error
    if given["player"] != player.identity:
        raise ValueError(f"player of the receipt must have the digest {given['player']}, got {player.identity}")
    own = plain_arguments(player.settings)
    # A receipt from before an argument was there has its default.
    told = {**{field.name: field.default for field in fields(Settings)}, **given["settings"]}
    for name in {**given["settings"], **own}:
        if told[name] != own.get(name):
            raise ValueError(f"{name} of the receipt must be {own.get(name)} here, got {told[name]}")
    return player


def verify(given: Mapping[str, Any], player: Player, progress: Callable[[int, int], None] | None = None) -> str:
    """Plays a receipt's episodes again and compares them; a sentence with what agrees, and how closely.

    On the same machine, with the same versions and code, every metric must be the same to the last bit; elsewhere every
    episode's energy to `TOLERANCE`.

    Args:
        given: the receipt.
        player: its player, as `player_again` gives it.
        progress: called with the control periods done and in all.

    Raises:
        ValueError: the results differ; the message has the worst episode.
    """
    own = receipt(given, player, list(given["seeds"]), in_all_regimes(player, given["seeds"], progress))
    elsewhere = [name for name in ("code", "machine", "versions") if own[name] != given[name]]
    worst, where = 0.0, "every episode"
    for regime, told in given["joules"].items():
        before, now = np.asarray(told, dtype=np.float64), np.asarray(own["joules"][regime])
        apart = np.abs(now - before) / np.maximum(np.abs(before), 1.0)
        apart[np.isnan(apart)] = np.inf
        if apart.max() > worst:
            worst, k = float(apart.max()), int(apart.argmax())
            pair = f"{float(before[k])!r} J on the receipt, {float(now[k])!r} J here"
            where = f"regime {regime}, seed {given['seeds'][k]}: {pair}"
    if own["digest"] == given["digest"] and worst == 0.0:
        return f"verified to the last bit{_beside(elsewhere)}: {_mean(own)}"
    if not elsewhere:
        raise ValueError(f"results must be the receipt's to the last bit on the same machine, got {worst:.2g}; {where}")
    if not worst <= TOLERANCE:
        raise ValueError(
            f"energies must be the receipt's to {TOLERANCE:g}, got {worst:.2g}{_beside(elsewhere)}; {where}"
        )
    return f"verified to {worst:.2g} relative, within {TOLERANCE:g}{_beside(elsewhere)}: {_mean(own)}"


def _beside(elsewhere: list[str]) -> str:
    return f" with other {', '.join(elsewhere)}" if elsewhere else " on the same machine, versions and code"


def _mean(own: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {np.mean(values):.6g} J" for name, values in own["joules"].items())


def _digest(results: Results) -> str:
    """SHA-256 of every metric of every episode, bit by bit."""
    digest = hashlib.sha256()
    for regime, metrics in sorted(results.items()):
        for name, values in sorted(metrics.items()):
            digest.update(f"{regime}/{name}".encode())
            digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return digest.hexdigest()

"""Guest: a player from outside the registry, with the label that it has in tables, figures and files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from agents.evaluation.own import labelled, relabelled
from agents.evaluation.player import Player
from agents.evaluation.players import find_player
from agents.style import CONTROLLER_NAMES
from agents.tasks import Elbows
from elbow_gym.vector_env import ElbowArmVectorEnv


@dataclass(frozen=True, eq=False)
class Guest:
    """A player from outside the registry: as a user names it, or as a Python object.

    Raises:
        ValueError: the label is one of the registry's.
    """

    label: str
    what: Any
    """What `find_player` takes."""
    trust: bool = False
    """Whether a file that may run code when it is read may be read."""

    def __post_init__(self) -> None:
        if self.label in CONTROLLER_NAMES:
            raise ValueError(f"label of a player of your own must not be one of the registry, got {self.label}")

    @classmethod
    def named(cls, word: str, trust: bool = False) -> Guest:
        """The guest in WHAT or LABEL=WHAT of a command line."""
        label, what = labelled(word)
        return cls(what if label is None else label, what, trust)

    def player(self, elbows: Elbows, arguments: Mapping[str, Any]) -> Player:
        """The player in the default environment with elbows on the table and further arguments.

        Raises:
            ValueError: it does not fit the environment, or there is none.
        """
        player = find_player(self.what, elbows, arguments=arguments, trust=self.trust)
        return relabelled(player, self.label)

    def plays_at(self, counts: Sequence[int]) -> list[int]:
        """The elbow counts of the default environment that the player can play at, out of some.

        Raises:
            ValueError: it can play at none; the message says why.
        """
        found, refusals = [], []
        for elbows in counts:
            try:
                player = self.player(elbows, {})
                player.make(ElbowArmVectorEnv(1, **player.settings.arguments))
            except ValueError as refusal:
                refusals.append(str(refusal))
            else:
                found.append(elbows)
        if not found:
            raise ValueError(refusals[0])
        return found

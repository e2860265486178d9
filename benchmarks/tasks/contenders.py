"""Contenders on the evaluation tasks: classical controllers, policies of one circle and of drawn tasks, and guests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from agents.evaluation.own import labelled
from agents.evaluation.player import Player
from agents.evaluation.players import PLANNERS, Entry, find_player, learned
from elbow_gym.suite import ENV

PD = "pd"
"""Player that the others' gains are counted from."""
CLASSICAL = (PD, "computed_torque", "computed_torque_posture")
SPECIALISTS = ("ppo", "sac", "clone")
"""Policies of one circle."""
ESTIMATORS = tuple(name for name in PLANNERS if name.endswith("_payload"))
"""Planners that estimate the payload, which policies of drawn tasks are told."""


@dataclass(frozen=True)
class Contender:
    """A player at an elbow count, with the seed of its training."""

    name: str
    """Name in tables and figures."""
    elbows: int
    entry: Entry | None = None
    """Entry of the registry; None for a player that is named by `what`."""
    what: str = ""
    """Name, path or import path of a player."""
    seed: int | None = None
    """Seed of the training; None where nothing was trained, or where it is not known."""
    trust: bool = False
    """Whether a file that may run code when it is read may be read."""

    @property
    def slow(self) -> bool:
        """Whether it is one of `ESTIMATORS` that nobody has named: an episode takes it ten seconds of CPU time."""
        return self.entry is not None and self.name in ESTIMATORS

    def player(self) -> Player:
        """The player.

        Raises:
            ValueError: there is none, or it does not fit the elbows.
        """
        if self.entry is not None:
            return self.entry.player(self.seed)
        return replace(find_player(self.what, self.elbows, ENV, trust=self.trust), name=self.name)


def contenders(
    counts: Sequence[int], guests: Sequence[str] = (), planners: bool = False, trust: bool = False
) -> list[Contender]:
    """Everybody who plays, at each elbow count; policies with all of their training seeds.

    Args:
        counts: numbers of elbows on the table.
        guests: players of the user's own, WHAT or LABEL=WHAT, several with one label as its training seeds.
        planners: whether `ESTIMATORS` play.
        trust: whether files that may run code when they are read may be read.

    Raises:
        ValueError: a guest plays at none of the counts, for the reason that the message says.
    """
    found = [one for elbows in counts for one in _registered(elbows, planners)]
    for word in guests:
        label, what = labelled(word)
        refusals = []
        for elbows in counts:
            one = Contender(label or what, elbows, what=what, trust=trust)
            # A policy plays with the elbows that it was trained with.
            try:
                one.player()
            except ValueError as refusal:
                refusals.append(refusal)
            else:
                found.append(one)
        if len(refusals) == len(counts):
            raise refusals[0]
    return found


def _registered(elbows: int, planners: bool) -> list[Contender]:
    names = (*CLASSICAL, *(ESTIMATORS if planners else ()))
    policies = [Entry(name, elbows) for name in SPECIALISTS]
    policies += [entry for entry in learned() if (entry.elbows, entry.env) == (elbows, ENV)]
    found = [Contender(name, elbows, Entry(name, elbows)) for name in names]
    return found + [Contender(entry.name, elbows, entry, seed=seed) for entry in policies for seed in entry.seeds]

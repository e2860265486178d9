"""The comparisons of the energy benchmark: which player, in which part, with what settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from agents.evaluation.guest import Guest
from agents.evaluation.metrics import REGIMES, Regime
from agents.evaluation.player import Player
from agents.evaluation.players import CLASSICAL, ELBOW_COUNTS, PLANNERS, TABLE_ENV, Entry, entries, find_player
from agents.evaluation.regimes import SHIFTED
from agents.style import CONTROLLER_NAMES
from elbow_gym.baselines.pd import PAPER_KD, PAPER_KP, PDController
from elbow_gym.task.settings import Settings

PARTS = {
    "nominal": "the default environment",
    "shifted": "wider starts, drawn circles and payloads that no training used",
    "table": "ElbowArmTable-v0: the table alone carries the arm",
}
"""Parts of the benchmark and what they are."""
FEATURED = ("lqr", "sac", "ppo", "computed_torque", "pd_gravity", "pd", "pd_paper")
"""Controllers of the short table and the figure: the best known, the learned, and the classical ones."""
GAINS = (0.25, 0.5, 2.0, 4.0)
"""Factors of both gains of the paper's PD in the sweep beside it."""


Arguments = tuple[tuple[str, Any], ...]
"""Names and values, which can be hashed."""


@dataclass(frozen=True)
class Cell:
    """One controller at one elbow count in one part of the benchmark."""

    controller: str
    """Name of the player."""
    elbows: int
    part: str = "nominal"
    gain: float = 1.0
    """Factor of the PD's gains."""
    guest: Guest | None = None
    """Player of a user's own; None for the registry's."""
    arguments: Arguments = ()
    """Further arguments of the environment, such as another arm, by name."""

    @property
    def entry(self) -> Entry:
        """Entry of the registry that plays the cell."""
        nominal = Entry(self.controller, self.elbows)
        return nominal._replace(env=TABLE_ENV) if self.part == "table" else nominal

    @property
    def regimes(self) -> tuple[Regime, ...]:
        """Regimes that are counted: on drawn circles none starts on the target, and of the sweep A is shown."""
        if self.gain != 1.0:
            return REGIMES[:1]
        return tuple(regime for regime in REGIMES if self.part != "shifted" or regime.start == "paper")


def cells(parts: Sequence[str] = tuple(PARTS)) -> list[Cell]:
    """Every comparison, part by part: the classical controllers, and what a file is there for."""
    everyone = entries()
    result = [Cell(entry.name, entry.elbows) for entry in everyone if entry.env != TABLE_ENV]
    # The LQR's trajectory is of one circle, and the 10 kHz PD has a supply that the others have not.
    result += [replace(cell, part="shifted") for cell in result if cell.controller not in ("lqr", "pd_paper")]
    result += [Cell(entry.name, entry.elbows, "table") for entry in everyone if entry.env == TABLE_ENV]
    return [cell for cell in result if cell.part in parts]


def featured(controller: str) -> bool:
    """Whether a controller is in the short table and the figure: those of `FEATURED`, and who was asked for by name."""
    return controller in FEATURED or controller in PLANNERS or controller not in CONTROLLER_NAMES


def guest_cells(guests: Sequence[Guest], counts: Sequence[int]) -> list[Cell]:
    """Comparisons of a user's own players in the nominal part, at the elbow counts that each can play.

    Raises:
        ValueError: two have the same label, or one can play at none of the counts; the message says why.
    """
    labels = [guest.label for guest in guests]
    if len(set(labels)) < len(labels):
        raise ValueError(f"labels of players of your own must differ, got {labels}")
    return [Cell(guest.label, elbows, guest=guest) for guest in guests for elbows in guest.plays_at(counts)]


def own_arm_cells(
    arguments: Mapping[str, Any], guests: Sequence[Guest] = (), planners: Sequence[str] = ()
) -> list[Cell]:
    """Comparisons on a user's own arm: the classical controllers that reach its circle, planners and guests.

    Args:
        arguments: arguments of the environment, the arm and the elbows' joints among them.
        guests: players of the user's own.
        planners: names of planners.
    """
    settings = Settings(**arguments)
    parsed = {**arguments, "arm": settings.parsed_arm, "elbows": settings.elbow_joints}
    shared = tuple(sorted({**parsed, "circle": settings.parsed_circle}.items()))
    names = [(name, None) for name in (*CLASSICAL, *planners) if name != "pd_paper"]
    names += [(guest.label, guest) for guest in guests]
    return [Cell(name, len(settings.elbow_joints), guest=guest, arguments=shared) for name, guest in names]


def sweep() -> list[Cell]:
    """The paper's PD at 24 V with other gains, for the Pareto figure."""
    return [Cell("pd", elbows, gain=gain) for elbows in ELBOW_COUNTS for gain in GAINS]


def players(cell: Cell, every_seed: bool = True) -> list[Player]:
    """The players of a cell: one, or one for each training seed; without `every_seed` the best of these alone."""
    more = dict(cell.arguments)
    if cell.guest is not None or more:
        # On another arm the joints are given: a count means the paper's.
        elbows = more.pop("elbows", cell.elbows)
        what = cell.controller if cell.guest is None else cell.guest
        found = [find_player(what, elbows, arguments=more) if isinstance(what, str) else what.player(elbows, more)]
        return [replace(player, name=cell.controller) for player in found]
    found = [cell.entry.player(seed) for seed in (cell.entry.seeds if every_seed else [None])]
    if cell.gain != 1.0:
        make = partial(PDController, kp=cell.gain * PAPER_KP, kd=cell.gain * PAPER_KD)
        found = [replace(player, make=make, identity=f"{player.identity} x {cell.gain:g}") for player in found]
    if cell.part == "shifted":
        found = [replace(player, settings=replace(player.settings, **SHIFTED)) for player in found]
    return found


def work(cell: Cell, every_seed: bool = True) -> int:
    """Cost of a cell, in control periods of the PD."""
    starts = {regime.start for regime in cell.regimes}
    return len(starts) * sum(player.work for player in players(cell, every_seed))

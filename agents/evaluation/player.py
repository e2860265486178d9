"""Player: a controller with its environment, name, colour and marker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from agents.control.controller import Controller
from agents.style import look
from elbow_gym.baselines.policy import Policy
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

Maker = Callable[[ElbowArmVectorEnv], Controller]
"""Function that makes a controller for an environment."""

TABLE = "table"
"""Name of the compliant table where others have their number of elbows."""


@dataclass(frozen=True)
class Player:
    """A controller with the environment it plays in."""

    name: str
    """Name on the command line, in tables and in files of results."""
    task: str
    """Short name of the environment, as `agents.tasks.task_name` gives it."""
    settings: Settings
    """Arguments of the environment."""
    make: Maker
    label: str
    """Name in figures and tables for readers."""
    colour: str
    """Colour in figures, #rrggbb."""
    marker: str
    """Marker in figures, Matplotlib's letter."""
    seed: int | None = None
    """Seed of the training; None where nothing was trained."""
    effort: float = 1.0
    """Time of a control period, start included, as a multiple of the PD's [-], for the time left."""
    identity: str = ""
    """Digest of what the player is made of, beyond the code; empty where results must not be taken over."""
    starts_together: bool = False
    """Whether one controller serves arms that start in different poses at the same time."""

    @property
    def work(self) -> int:
        """Cost of an episode, in control periods of the PD."""
        return round(self.effort * self.settings.horizon)


def player_of(name: str, settings: Settings, make: Maker, **more: Any) -> Player:
    """A player from any maker of a controller; colour and marker are those of `agents.style`, if it has the name.

    Args:
        name: name of the player.
        settings: arguments of the environment.
        make: gives the controller for an environment with these settings.
        more: further fields of `Player`.
    """
    label, colour, marker = look(name)
    bearing = TABLE if settings.table is not False else f"elbows{len(settings.elbow_joints)}"
    fields = {"task": bearing, "label": label, "colour": colour, "marker": marker, **more}
    return Player(name=name, settings=settings, make=make, **fields)


def policy_player(name: str, policy: Policy, settings: Settings, **more: Any) -> Player:
    """A policy in environments that it was made for; its maker raises ValueError in others. See `player_of`."""
    return player_of(name, settings, policy.acting_in, identity=policy.card.digest, **more)

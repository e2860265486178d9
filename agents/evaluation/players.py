"""Registry of the players: controllers with their environments, names, colours and markers."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from agents.control.classical import COMPUTED, ComputedTorque, GravityPD, SmoothPD, economical_computed_torque
from agents.control.controller import Controller
from agents.control.lqr import TimeVaryingLQR
from agents.control.trajectory import Trajectory
from agents.shipped import OPTIMA
from agents.shipped.seeds import load_policy, shipped_path, shipped_policies, shipped_seeds
from agents.style import look
from agents.tasks import POLICY_NAME, task_settings
from elbow_gym.baselines.pd import CLIPPED, UNLIMITED, PDController
from elbow_gym.baselines.policy import Policy, baseline_path, pair, read_policy
from elbow_gym.baselines.tasks import registered_arguments, task_name
from elbow_gym.task.settings import STARTS, Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

Maker = Callable[[ElbowArmVectorEnv], Controller]
"""Function that makes a controller for an environment."""

ELBOW_COUNTS = (2, 1, 0)
"""Elbow counts of the rigid table that players are compared at."""
TABLE_ENV = "ElbowArmTable-v0"
TABLE = "table"
"""Name of the compliant table where others have their number of elbows."""


class Classical(NamedTuple):
    """A controller that needs neither training nor a trajectory."""

    arguments: Mapping[str, Any]
    """Arguments of the environment that it plays in."""
    make: Maker
    effort: float = 1.0
    """Time of a control period, times the PD's."""


CLASSICAL: dict[str, Classical] = {
    "pd_paper": Classical(UNLIMITED, PDController),
    "pd": Classical(CLIPPED, PDController),
    "pd_smooth": Classical(CLIPPED, SmoothPD, 1.4),
    "pd_gravity": Classical(CLIPPED, GravityPD, 1.9),
    "computed_torque": Classical(COMPUTED, ComputedTorque, 2.8),
    "computed_torque_posture": Classical(COMPUTED, economical_computed_torque, 6.0),
}
"""The classical controllers by name. "pd" is the paper's, clipped to 24 V and read at 2 kHz; "pd_paper" has no limit
and is read at 10 kHz."""
LQR_EFFORT = 20.0
"""Time of the LQR's control period, times the PD's: its gains are found before the first."""


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


class Entry(NamedTuple):
    """A name in an environment with an elbow count: one player, or one for each training seed."""

    name: str
    elbows: int
    env: str = "ElbowArm-v0"
    """Id of the environment that is played in."""

    @property
    def bearing(self) -> str:
        """Support of the arm: its number of elbows, or `TABLE`."""
        return TABLE if self.env == TABLE_ENV else str(self.elbows)

    @property
    def seeds(self) -> list[int | None]:
        """Training seeds that are shipped; [None] where nothing was trained."""
        group = learned().get(self)
        return [None] if group is None else list(shipped_seeds(group))

    def player(self, seed: int | None = None) -> Player:
        """The player of a training seed, of the best one when None.

        Raises:
            ValueError: the name is not in the registry.
        """
        if self.name in CLASSICAL:
            return classical_player(self.name, self.elbows, self.env)
        if self.name == "lqr":
            return lqr_player(self.elbows)
        group = learned().get(self)
        if group is None:
            raise ValueError(f"player must be one of {sorted({entry.name for entry in entries()})}, got {self.name!r}")
        path = baseline_path(group) if seed is None else shipped_path(group, seed)
        settings = task_settings(self.env, self.elbows)
        return policy_player(self.name, read_policy(path), settings, seed=int(path.name.rpartition("_seed")[2]))


def entries() -> list[Entry]:
    """All entries: classical controllers, and those that a file is there for; the compliant table's at the end.

    Where a policy for the compliant table is shipped, the classical controllers with a supply of 24 V play there too.
    """
    found = [Entry(name, elbows) for name in CLASSICAL for elbows in ELBOW_COUNTS]
    found += [
        Entry("lqr", elbows)
        for elbows in ELBOW_COUNTS
        if all(optimal_trajectory(elbows, start).is_file() for start in STARTS)
    ]
    policies = sorted(learned(), key=lambda entry: (entry.name, -entry.elbows))
    found += [entry for entry in policies if entry.env != TABLE_ENV]
    tabletop = [entry for entry in policies if entry.env == TABLE_ENV]
    if tabletop:
        found += [Entry(name, 0, TABLE_ENV) for name in CLASSICAL if name != "pd_paper"] + tabletop
    return found


def learned() -> dict[Entry, str]:
    """Shipped policies, without the seed in their names, by the entry that they play.

    A policy trained on drawn arms and circles plays the paper's, under a name that ends in "_random".
    """
    found: dict[Entry, str] = {}
    for group in sorted({policy.rpartition("_seed")[0] for policy in shipped_policies()}):
        parts = POLICY_NAME.fullmatch(group)
        if parts is None:
            continue
        name, task = parts["controller"], parts["task"]
        if task == "table":
            found[Entry(name, 0, TABLE_ENV)] = group
        elif task == "random":
            found[Entry(f"{name}_random", 2)] = group
        else:
            found[Entry(name, int(task.removeprefix("elbows")))] = group
    return found


def find_player(name: str, elbows: int | None = None, env: str = "ElbowArm-v0") -> Player:
    """A player by its name, as the command line takes it.

    Args:
        name: one of the registry ("pd", "lqr", "ppo"), or the path of a policy, which brings its own environment.
        elbows: elbows on the table; the environment's own number when None.
        env: id of the environment.

    Raises:
        ValueError: there is no such player, or a policy was trained with other elbows.
    """
    registered = registered_arguments(env)
    entry = Entry(name, registered.get("elbows", 2) if elbows is None else elbows, env)
    if name in CLASSICAL or (name == "lqr" and env == "ElbowArm-v0") or entry in learned():
        return entry.player()
    is_path = pair(Path(name))[0].is_file()
    if not is_path and not shipped_seeds(f"{name}_{task_name(env, elbows)}"):
        beside = {one.name for one in entries() if one[1:] == entry[1:]}
        known = sorted({*CLASSICAL, *beside})
        raise ValueError(f"player must be one of {known} in {task_name(env, elbows)}, or a policy's path, got {name!r}")
    policy = load_policy(name) if is_path else load_policy(name, elbows=elbows, env=env)
    if elbows is not None and policy.settings.elbows != elbows:
        raise ValueError(f"elbows must be {policy.settings.elbows} as in the policy's training, got {elbows}")
    task = task_name(policy.card.env, policy.card.environment["elbows"])
    return policy_player(name, policy, policy.settings, task=task)


def classical_player(name: str, elbows: int | None, env: str) -> Player:
    """One of `CLASSICAL` in a registered environment."""
    arguments, make, effort = CLASSICAL[name]
    settings = task_settings(env, elbows, arguments)
    more = {"task": task_name(env, elbows), "effort": effort, "identity": name, "starts_together": True}
    return player_of(name, settings, make, **more)


def optimal_trajectory(elbows: int, start: str) -> Path:
    """File of the optimal trajectory of the default reward from one of the environment's starts."""
    return OPTIMA / f"elbows{elbows}{'_on_target' if start == 'on_target' else ''}.npz"


def lqr_player(elbows: int) -> Player:
    """Player of the LQR around the optimal trajectory from the environment's start.

    Raises:
        ValueError: no optimal trajectory is there for the elbow count.
    """
    paths = {start: optimal_trajectory(elbows, start) for start in STARTS}
    missing = [path.name for path in paths.values() if not path.is_file()]
    if missing:
        raise ValueError(f"elbows of the LQR must be a count with an optimal trajectory, got {elbows}: no {missing[0]}")

    def follow(env: ElbowArmVectorEnv) -> TimeVaryingLQR:
        return TimeVaryingLQR(env, Trajectory.load(paths[env.settings.start]))

    digest = hashlib.sha256(b"".join(path.read_bytes() for path in paths.values())).hexdigest()
    return player_of("lqr", task_settings("ElbowArm-v0", elbows), follow, effort=LQR_EFFORT, identity=digest)


def policy_player(name: str, policy: Policy, settings: Settings, **more: Any) -> Player:
    """A policy in environments that it was made for; its maker raises ValueError in others. See `player_of`."""
    return player_of(name, settings, policy.acting_in, identity=policy.card.digest, **more)

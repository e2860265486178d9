"""Registry of the players: controllers with their environments, names, colours and markers."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from agents.control.classical import COMPUTED, ComputedTorque, GravityPD, SmoothPD, economical_computed_torque
from agents.control.lqr import TimeVaryingLQR
from agents.control.trajectory import Trajectory
from agents.evaluation.own import KINDS, labelled, own_player, python_player, relabelled
from agents.evaluation.player import TABLE, Maker, Player, player_of, policy_player
from agents.machine import versions
from agents.planning.receding_horizon import RecedingHorizon
from agents.planning.sampling import Sampling
from agents.shipped import OPTIMA
from agents.shipped.seeds import load_policy, shipped_path, shipped_policies, shipped_seeds
from agents.tasks import POLICY_NAME, Elbows, task_settings
from elbow_gym.baselines.pd import CLIPPED, UNLIMITED, PDController
from elbow_gym.baselines.policy import baseline_path, read_policy
from elbow_gym.baselines.tasks import registered_arguments, task_name
from elbow_gym.suite import ENV as TASKS_ENV
from elbow_gym.task.settings import STARTS
from elbow_gym.vector_env import ElbowArmVectorEnv

ELBOW_COUNTS = (2, 1, 0)
"""Elbow counts of the rigid table that players are compared at."""
TABLE_ENV = "ElbowArmTable-v0"


class Untrained(NamedTuple):
    """A controller that needs neither training nor a trajectory."""

    arguments: Mapping[str, Any]
    """Arguments of the environment that it plays in."""
    make: Maker
    effort: float = 1.0
    """Time of a control period, times the PD's."""


CLASSICAL: dict[str, Untrained] = {
    "pd_paper": Untrained(UNLIMITED, PDController),
    "pd": Untrained(CLIPPED, PDController),
    "pd_smooth": Untrained(CLIPPED, SmoothPD, 1.4),
    "pd_gravity": Untrained(CLIPPED, GravityPD, 1.9),
    "computed_torque": Untrained(COMPUTED, ComputedTorque, 2.8),
    "computed_torque_posture": Untrained(COMPUTED, economical_computed_torque, 6.0),
}
"""The classical controllers by name. "pd" is the paper's, clipped to 24 V and read at 2 kHz; "pd_paper" has no limit
and is read at 10 kHz."""
PLANNERS: dict[str, Untrained] = {
    "receding_horizon": Untrained({}, RecedingHorizon, 800.0),
    "sampling_mpc": Untrained({}, Sampling, 300.0),
    "receding_horizon_payload": Untrained({}, partial(RecedingHorizon, estimate_payload=True), 800.0),
    "sampling_mpc_payload": Untrained({}, partial(Sampling, estimate_payload=True), 300.0),
}
"""The planners by name, the last two with an estimate of the payload. They take too long for a comparison with
everybody, so that `entries` leaves them out."""
LQR_EFFORT = 20.0
"""Time of the LQR's control period, times the PD's: its gains are found before the first."""


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
        if self.name in CLASSICAL or self.name in PLANNERS:
            return untrained_player(self.name, self.elbows, self.env)
        if self.name == "lqr":
            return lqr_player(self.elbows)
        group = learned().get(self)
        if group is None:
            known = sorted({entry.name for entry in entries()} | set(PLANNERS))
            raise ValueError(f"player must be one of {known}, got {self.name!r}")
        path = baseline_path(group) if seed is None else shipped_path(group, seed)
        settings = task_settings(self.env, self.elbows)
        return policy_player(self.name, read_policy(path), settings, seed=int(path.name.rpartition("_seed")[2]))


def entries() -> list[Entry]:
    """All entries but `PLANNERS`: classical ones, and those that a file is there for; the compliant table's at the end.

    Policies of `TASKS_ENV` are left out: each of their episodes is another task.
    Where a policy for the compliant table is shipped, the classical controllers with a supply of 24 V play there too.
    """
    found = [Entry(name, elbows) for name in CLASSICAL for elbows in ELBOW_COUNTS]
    found += [
        Entry("lqr", elbows)
        for elbows in ELBOW_COUNTS
        if all(optimal_trajectory(elbows, start).is_file() for start in STARTS)
    ]
    policies = sorted((one for one in learned() if one.env != TASKS_ENV), key=lambda entry: (entry.name, -entry.elbows))
    found += [entry for entry in policies if entry.env != TABLE_ENV]
    tabletop = [entry for entry in policies if entry.env == TABLE_ENV]
    if tabletop:
        found += [Entry(name, 0, TABLE_ENV) for name in CLASSICAL if name != "pd_paper"] + tabletop
    return found


def learned() -> dict[Entry, str]:
    """Shipped policies, without the seed in their names, by the entry that they play.

    A policy trained on drawn arms and circles plays the paper's, under a name that ends in "_random". The name of one
    that plays in `TASKS_ENV` ends in "_tasks".
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
        elif task.startswith("tasks"):
            found[Entry(f"{name}_tasks", int(task.removeprefix("tasks_elbows")) if "_" in task else 2, TASKS_ENV)] = (
                group
            )
        else:
            found[Entry(name, int(task.removeprefix("elbows")))] = group
    return found


def find_player(
    what: Any,
    elbows: Elbows | None = None,
    env: str = "ElbowArm-v0",
    arguments: Mapping[str, Any] | None = None,
    trust: bool = False,
) -> Player:
    """A player by its name, as the command line takes it, or from a Python object.

    Args:
        what: one of the registry ("pd", "lqr", "ppo"), one of `own.KINDS`, either with LABEL= before it; or an object
            that `own.python_player` takes. Policies, and ONNX files with a contract, bring their environments.
        elbows: elbows on the table; the environment's own number when None.
        env: id of the environment.
        arguments: further arguments of the environment, such as the arm, which take precedence over the player's own.
        trust: whether a file that may run code when it is read may be read.

    Raises:
        ValueError: there is no such player, it does not fit the environment, or its file is not trusted.
    """
    more = dict(arguments or {})
    if isinstance(what, Player):
        return what
    if not isinstance(what, str):
        return python_player(getattr(what, "__name__", type(what).__name__), what, elbows, env, more)
    label, name = labelled(what)
    found = _registered(name, elbows, env, more) or own_player(name, elbows, env, more, trust)
    if found is None:
        task = "joints" if isinstance(elbows, tuple) else task_name(env, elbows)
        raise ValueError(f"player must be one of {known_names(elbows, env)} in {task}, or {KINDS}, got {name!r}")
    return relabelled(found, label)


def known_names(elbows: Elbows | None = None, env: str = "ElbowArm-v0") -> list[str]:
    """Names of the registry in an environment with elbows, the classical controllers' first and the planners' last."""
    count = registered_arguments(env).get("elbows", 2) if elbows is None else elbows
    beside = {one.name for one in (*entries(), *learned()) if one[1:] == (count, env)}
    return [*CLASSICAL, *sorted(beside - set(CLASSICAL)), *PLANNERS]


def _registered(name: str, elbows: Elbows | None, env: str, more: Mapping[str, Any]) -> Player | None:
    """The player of a name in the registry; None where it is not there."""
    count = registered_arguments(env).get("elbows", 2) if elbows is None else elbows
    if name in CLASSICAL or name in PLANNERS:
        return untrained_player(name, elbows, env, more)
    if name == "lqr" and env == "ElbowArm-v0":
        if more or isinstance(count, tuple):
            raise ValueError(f"lqr must play its optimal trajectory in the default environment, got {sorted(more)}")
        return lqr_player(count)
    if isinstance(count, tuple):
        return None
    if (entry := Entry(name, count, env)) in learned():
        found = entry.player()
        return replace(found, settings=replace(found.settings, **more))
    if shipped_seeds(f"{name}_{task_name(env, elbows)}"):
        policy = load_policy(name, elbows=elbows, env=env)
        return policy_player(name, policy, replace(policy.settings, **more))
    return None


def untrained_player(name: str, elbows: Elbows | None, env: str, more: Mapping[str, Any] | None = None) -> Player:
    """One of `CLASSICAL` or `PLANNERS` in a registered environment, whose further arguments `more` has."""
    arguments, make, effort = {**CLASSICAL, **PLANNERS}[name]
    settings = task_settings(env, elbows, {**arguments, **(more or {})})
    # A planner's solver is no part of this code.
    identity = f"{name} {versions('casadi')}" if name in PLANNERS else name
    return player_of(name, settings, make, effort=effort, identity=identity, starts_together=True)


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

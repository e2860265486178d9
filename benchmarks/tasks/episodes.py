"""Episodes of players on evaluation tasks, also where the arm, the sensors or the load are not as they think."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.classical import ComputedTorque, economical_pose, task_pose
from agents.control.controller import Controller
from agents.evaluation.metrics import RETURN_PERIOD, metrics
from agents.evaluation.player import Player
from agents.evaluation.recording import record
from agents.jobs.job import Tell
from agents.optimal.certificate import LATER
from agents.tasks import plain_arguments
from benchmarks.energy import cache
from benchmarks.tasks.contenders import Contender
from elbow_gym.baselines.pd import PDController
from elbow_gym.interface import Interface
from elbow_gym.task.observation import ObservationLayout
from elbow_gym.task.reward import Price, early_end
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

UNITS = {"cost": "-", "energy": "J", "error_rms": "mm", "below_table": "s", "complete": "-"}
"""Figures of an episode and their units: energy of all of it, error from `LATER` on, and whether it came to its end."""


@dataclass(frozen=True)
class Disturbance:
    """A difference between the arm and what its controller takes it for."""

    meaning: str
    randomize: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Ranges of the arm's parameters, drawn with the task's number as seed, whoever plays."""
    told: bool = True
    """Whether those who can be told of the payload are."""


NOMINAL = "none"
CONSTANTS = ("mass", "joint_viscous_friction", "gear_viscous_friction", "torque_constant", "armature_resistance")
DISTURBANCES = {
    NOMINAL: Disturbance("the arm as it is known"),
    "constants": Disturbance(
        "masses, frictions, torque constants and resistances off by up to 10 %, each by itself",
        dict.fromkeys(CONSTANTS, (0.9, 1.1)),
    ),
    "noise": Disturbance("sensor noise of 0.002: 0.6 mrad, 4 mrad/s, 10 mA, 1 mm", {"sensor_noise": 0.002}),
    "delay": Disturbance("voltages come one of the player's control periods late", {"action_delay": 1}),
    "payload": Disturbance("nobody is told of the payload", told=False),
}
"""Disturbances by name."""


class Veiled:
    """Controller that is given the entries of an observation that it knows.

    Args:
        inner: controller made for an undisturbed environment.
        known: entries of the observation that it takes, (k,).
        hidden: the one of these that is zero to it, if there is one.
    """

    def __init__(self, inner: Controller, known: NDArray[np.int64], hidden: int | None) -> None:
        self._inner, self._known, self._hidden = inner, known, hidden

    def predict(self, observation: NDArray[np.float32], *args: Any, **kwargs: Any) -> tuple[NDArray[np.float32], Any]:
        """The controller's actions."""
        given = observation[:, self._known]
        if self._hidden is not None:
            given[:, self._hidden] = 0.0
        return self._inner.predict(given, *args, **kwargs)


def _pd(env: ElbowArmVectorEnv, payload: float) -> Controller:
    del payload  # It holds no load.
    interface = Interface(env)
    return PDController(env, pose=task_pose(interface.arm, interface.elbows, interface.circle))


def _computed_torque(
    env: ElbowArmVectorEnv, payload: float, pose: Callable[..., NDArray[np.float64]] = task_pose
) -> Controller:
    interface = Interface(env)
    chosen = pose(interface.arm, interface.elbows, interface.circle, payload)
    return ComputedTorque(env, chosen, payload=payload)


TOLD: dict[str, Callable[[ElbowArmVectorEnv, float], Controller]] = {
    "pd": _pd,
    "computed_torque": _computed_torque,
    "computed_torque_posture": partial(_computed_torque, pose=economical_pose),
}
"""Makers of the classical controllers for a task with a payload [kg]: they need a posture that reaches the circle."""


def play(
    player: Player,
    number: int,
    task: Mapping[str, Any],
    disturbance: Disturbance,
    around: Callable[[Controller], Controller] = lambda controller: controller,
) -> dict[str, float]:
    """Figures of a player's episode by the names of `UNITS`.

    The controller is made for the task in an undisturbed environment. An episode that it refuses, or that ends early,
    has the worst figures that the environment charges.

    Args:
        player: the player.
        number: seed of what the disturbance draws.
        task: options of a reset, as `elbow_gym.evaluation_tasks` has them.
        disturbance: difference between the arm and what the controller takes it for.
        around: puts a controller of the caller's around the player's.
    """
    from threadpoolctl import threadpool_limits

    alone = replace(player.settings, **_fixed(task))

    def make(env: ElbowArmVectorEnv) -> Controller:
        undisturbed = ElbowArmVectorEnv(1, **alone.arguments)
        payload = task["parameters"]["payload"] if disturbance.told else 0.0
        told = TOLD.get(player.name)
        inner = around(player.make(undisturbed) if told is None else told(undisturbed, payload))
        layout, names = undisturbed.episodes.layout, env.episodes.layout.names
        hides = layout.task and not disturbance.told
        hidden = layout.slices["payload"].start if hides else None
        return Veiled(inner, np.array([names.index(name) for name in layout.names]), hidden)

    disturbed = replace(alone, randomize=dict(disturbance.randomize) or None)
    every = max(1, round(RETURN_PERIOD / disturbed.control_period))
    options = {name: task[name] for name in ("state", "parameters")}
    try:
        # On more threads BLAS adds up in another order.
        with threadpool_limits(1):
            recording = record(disturbed, make, [number], every=every, options=options)
    except (ValueError, ArithmeticError):
        return worst(alone)
    whole, later = metrics(recording), metrics(recording, LATER)
    figures = (-whole["return"], whole["electrical_energy"], later["error_rms"], whole["below_table"], [1.0])
    return {name: float(value[0]) for name, value in zip(UNITS, figures, strict=True)}


def _fixed(task: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of an environment that does a task and draws nothing."""
    still = {"start": "paper", "start_noise": 0.0, "start_spread": 0.0, "randomize": None, "payload": 0.0}
    return {**still, "circle": task["circle"]}


def worst(settings: Settings) -> dict[str, float]:
    """Figures of an episode that the environment would charge from its first control period on."""
    arm, limit = settings.parsed_arm, np.array([settings.voltage_limit])
    price = Price(settings.tracking_weight, settings.energy_weight, 1.0 / RETURN_PERIOD, settings.regeneration)
    periods = np.array([round(settings.duration / RETURN_PERIOD)])
    charge = early_end(
        ObservationLayout(arm.n_joints), limit, arm.of_motors("armature_resistance")[None], price, periods
    )
    energy = -float(charge.energy[0]) / settings.energy_weight * RETURN_PERIOD
    error = -1e3 * float(charge.tracking[0]) / settings.tracking_weight / int(periods[0])
    return dict(zip(UNITS, (-float(charge.total[0]), energy, error, settings.duration, 0.0), strict=True))


def played(
    contender: Contender, tasks: Mapping[int, Mapping[str, Any]], name: str, folder: Path, tell: Tell
) -> dict[int, dict[str, float]]:
    """Figures of a contender's episodes by the tasks' numbers, from the folder where they were played before.

    Args:
        contender: who plays.
        tasks: tasks by their numbers.
        name: name of the disturbance.
        folder: folder of what was played before.
        tell: called with 1 after each task.
    """
    player, disturbance = contender.player(), DISTURBANCES[name]
    found = {}
    for number, task in tasks.items():
        asked = {"number": number, "task": task, "randomize": disturbance.randomize, "told": disturbance.told}
        question = {"player": player.identity, "settings": plain_arguments(player.settings), **asked}
        key = cache.key(json.loads(json.dumps(question)))
        # Whoever has no identity may be another one the next time.
        stored = cache.load(key, folder) if player.identity else None
        if stored is None:
            figures = play(player, number, task, disturbance)
            stored = {name: {figure: np.array([value]) for figure, value in figures.items()}}
            if player.identity:
                cache.store(key, stored, folder)
        (of,) = stored.values()
        found[number] = {figure: float(values[0]) for figure, values in of.items()}
        tell(1)
    return found

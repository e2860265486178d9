"""Plays one controller in all regimes and says what it cost."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.classical import COMPUTED, ComputedTorque, GravityPD, SmoothPD, economical_computed_torque
from agents.control.controller import Controller
from agents.evaluation.metrics import REGIMES, UNITS, Regime, joint_energies, metrics
from agents.evaluation.recording import record
from agents.shipped.seeds import load_policy
from agents.tasks import task_settings
from elbow_gym.baselines.pd import CLIPPED, UNLIMITED, PDController
from elbow_gym.baselines.policy import Policy, pair
from elbow_gym.baselines.tasks import registered_arguments
from elbow_gym.simulation.options import TABLE_TIMESTEP
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

BENCHMARK_SEEDS = tuple(range(20_000, 20_020))
"""Fixed and public; no training and no choice of a policy uses them."""

SHIFTED: dict[str, Any] = {
    "start_noise": 0.04,
    "circle": {"radius": [0.05, 0.1], "period": [3.5, 7.0], "phase": "random"},
    "randomize": {"payload": [0.05, 0.2]},
}
"""What the shifted set changes in an environment. No training and no tuning has used it; controllers are told the
circle and not the payload. Larger circles are out of the paper PD's reach."""

RECORDING_PERIOD = 0.001
"""Fast controllers are recorded at this rate [s], slower ones at their own."""

CLASSICAL: dict[str, tuple[dict[str, Any], Callable[[ElbowArmVectorEnv], Controller]]] = {
    "pd_paper": (UNLIMITED, PDController),
    "pd": (CLIPPED, PDController),
    "pd_smooth": (CLIPPED, SmoothPD),
    "pd_gravity": (CLIPPED, GravityPD),
    "computed_torque": (COMPUTED, ComputedTorque),
    "computed_torque_posture": (COMPUTED, economical_computed_torque),
}
"""Arguments of the environment and maker of each controller that needs neither training nor a trajectory."""

Results = dict[str, dict[str, NDArray[np.float64]]]


def in_all_regimes(
    settings: Settings,
    make_controller: Callable[[ElbowArmVectorEnv], Controller],
    seeds: Sequence[int] = BENCHMARK_SEEDS,
    progress: Callable[[int, int], None] | None = None,
    regimes: Sequence[Regime] = REGIMES,
) -> Results:
    """Metrics of every episode (S,) by regime and name; `joint_energy` beside them is (S, n).

    Regimes with the same start share one run.
    """
    results: Results = {}
    recordings = {}
    for regime in regimes:
        if regime.start not in recordings:
            started = replace(settings, start=regime.start)
            every = max(1, round(settings.control_frequency * RECORDING_PERIOD))
            recordings[regime.start] = record(started, make_controller, seeds, progress, every)
        recording = recordings[regime.start]
        results[regime.name] = metrics(recording, regime.since)
        results[regime.name]["joint_energy"] = joint_energies(recording, regime.since)
    return results


def named_controller(
    name: str, elbows: int | None, env: str = "ElbowArm-v0"
) -> tuple[Settings, Callable[[ElbowArmVectorEnv], Controller]]:
    """The environment and the maker of a controller by its name.

    Names: those of `CLASSICAL` ("pd" is the paper's clipped to 24 V and read at 2 kHz, "pd_paper" unlimited at 10 kHz),
    an algorithm whose policy is shipped ("ppo", its best seed), or the path of a policy, which brings its own `env`.
    """
    if name in CLASSICAL:
        arguments, make = CLASSICAL[name]
        return settings_for(arguments, env, elbows), make
    is_path = pair(Path(name))[0].is_file()
    policy = load_policy(name) if is_path else load_policy(name, elbows=elbows, env=env)
    if elbows is not None and policy.settings.elbows != elbows:
        raise ValueError(f"elbows must be {policy.settings.elbows} as in the policy's training, got {elbows}")
    return policy.settings, policy_maker(policy)


def settings_for(arguments: Mapping[str, Any], env: str, elbows: int | None = None) -> Settings:
    """A registered environment with a classical controller's own arguments; a table asks for shorter RK4 steps."""
    table = registered_arguments(env).get("table", False) is not False
    shorter = {"timestep": min(TABLE_TIMESTEP, arguments["timestep"])} if table and "timestep" in arguments else {}
    return task_settings(env, elbows, {**arguments, **shorter})


def policy_maker(policy: Policy) -> Callable[[ElbowArmVectorEnv], Controller]:
    """Gives the policy for environments that it was made for, and ValueError for others."""

    def make(env: ElbowArmVectorEnv) -> Controller:
        policy.check(env)
        return policy

    return make


def print_results(title: str, results: Results) -> None:
    """A table on the terminal: one row per metric, one column per regime, mean and standard deviation."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title)
    table.add_column("metric")
    table.add_column("unit")
    for regime in REGIMES:
        table.add_column(f"{regime.name}: {regime.meaning.split(':')[0]}", justify="right")
    for name, unit in UNITS.items():
        cells = [f"{results[r.name][name].mean():.4g} ± {results[r.name][name].std():.2g}" for r in REGIMES]
        table.add_row(name.replace("_", " "), unit, *cells)
    Console().print(table)

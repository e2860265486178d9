"""Recordings of whole episodes of a controller in the batched environment."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.controller import Controller
from elbow_gym.checks import as_numbers
from elbow_gym.simulator import Simulator
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Recording:
    """B whole episodes at T + 1 instants: the start and the end of every (or every few) control periods."""

    settings: Settings
    seeds: tuple[int, ...]
    time: Array
    """Time since the start [s], (T + 1,)."""
    q: Array
    """Relative joint angles [rad], (T + 1, B, n)."""
    q_dot: Array
    """Rates of the joint angles [rad/s], (T + 1, B, n)."""
    hand: Array
    """Position of the hand [m], (T + 1, B, 3)."""
    target: Array
    """Position of the target [m], (T + 1, B, 3)."""
    electrical_energy: Array
    """Signed electrical energy of each joint since the start [J], (T + 1, B, n)."""
    drawn_energy: Array
    """Integral of the positive electrical power of each joint since the start [J], (T + 1, B, n)."""
    copper_loss: Array
    """Heat in each winding since the start [J], (T + 1, B, n)."""
    link_work: Array
    """Work of each motor on the links since the start [J], (T + 1, B, n)."""
    elbow_force: Array
    """Force of the table on each elbow along +z [N], (T + 1, B, p); negative where it pulls."""
    below_table: Array
    """Time under the table since the start [s], (T + 1, B)."""
    voltage: Array
    """Terminal voltage of largest magnitude since the instant before, zero at the first [V], (T + 1, B, n)."""
    current: Array
    """Armature currents [A], (T + 1, B, n)."""


def record(
    settings: Settings,
    make_controller: Callable[[ElbowArmVectorEnv], Controller],
    seeds: Sequence[int],
    progress: Callable[[int, int], None] | None = None,
    every: int = 1,
    options: Mapping[str, Any] | None = None,
) -> Recording:
    """Runs one episode per seed, side by side, through the engine of the batched environment.

    Args:
        settings: the environment's arguments.
        make_controller: gives the controller for the environment.
        seeds: one per episode.
        progress: called with the periods done and in all, a hundred times a run.
        every: number of control periods between two recorded instants, a divisor of their number.
        options: options of the reset, the same for all arms.

    Raises:
        ValueError: `every` does not divide the number of control periods, or the environment refuses the options.
        ArithmeticError: the simulation left what float64 can represent.
    """
    return record_starts(settings, (settings.start,), make_controller, seeds, progress, every, options)[settings.start]


def record_starts(
    settings: Settings,
    starts: Sequence[str],
    make_controller: Callable[[ElbowArmVectorEnv], Controller],
    seeds: Sequence[int],
    progress: Callable[[int, int], None] | None = None,
    every: int = 1,
    options: Mapping[str, Any] | None = None,
) -> dict[str, Recording]:
    """Runs one episode per seed from each of several starts, all side by side under one controller.

    Each arm's episode is that of `record` from its start. A control period of few arms costs about as much as of many,
    so two starts together take half the time of one after the other.

    Args:
        settings: the environment's arguments but for `start`.
        starts: the environment's `start` of the recordings, each once.
        make_controller: gives the controller for the environment with the arms of all starts.
        seeds: one per episode, the same for every start.
        progress: called with the periods done and in all, a hundred times a run.
        every: number of control periods between two recorded instants, a divisor of their number.
        options: options of the reset, the same for all arms.

    Returns:
        The recordings by start.

    Raises:
        ValueError: `every` does not divide the number of control periods, or the environment refuses the options.
        ArithmeticError: the simulation left what float64 can represent.
    """
    horizon = settings.horizon
    if every < 1 or horizon % every:
        raise ValueError(f"every must divide the number of control periods ({horizon}), got {every}")
    env, observation = _started(settings, starts, seeds, options)
    controller = make_controller(env)
    episodes = env.episodes
    series: dict[str, Any] = {}

    def keep(k: int, voltage: Array) -> None:
        values = {**instant(episodes.simulator), "target": episodes.target(), "voltage": voltage}
        for name, value in values.items():
            if name not in series:
                series[name] = np.empty((horizon // every + 1, *value.shape))
            series[name][k] = value

    largest = np.zeros((env.num_envs, episodes.arm.n_joints))
    keep(0, largest)
    for k in range(1, horizon + 1):
        action, _ = controller.predict(observation, deterministic=True)
        outcome = episodes.step(as_numbers("action", action, largest.shape))
        observation, voltage = outcome.observation, outcome.info["voltage"]
        if outcome.terminated.any():
            raise ArithmeticError(f"the simulation left what float64 can represent at {k * settings.control_period} s")
        largest = np.where(np.abs(voltage) > np.abs(largest), voltage, largest)
        if k % every == 0:
            keep(k // every, largest)
            largest = np.zeros_like(largest)
        if progress is not None and k % max(1, horizon // 100) == 0:
            progress(k, horizon)
    time = np.arange(horizon // every + 1) * (every * settings.control_period)
    recordings = {}
    for number, start in enumerate(starts):
        mine = slice(number * len(seeds), (number + 1) * len(seeds))
        own = {name: np.ascontiguousarray(values[:, mine]) for name, values in series.items()}
        recordings[start] = Recording(replace(settings, start=start), tuple(seeds), time, **own)
    return recordings


def instant(simulator: Simulator) -> dict[str, Array]:
    """Fields of a `Recording` that a simulator shows by itself, as they are now; each with the arms first."""
    return {
        "q": simulator.q,
        "q_dot": simulator.q_dot,
        "hand": simulator.hand_position,
        "electrical_energy": simulator.electrical_energy,
        "drawn_energy": simulator.drawn_energy,
        "copper_loss": simulator.copper_loss,
        "link_work": simulator.link_work,
        "elbow_force": simulator.elbow_force,
        "below_table": simulator.below_table,
        "current": simulator.current,
    }


def _started(
    settings: Settings, starts: Sequence[str], seeds: Sequence[int], options: Mapping[str, Any] | None
) -> tuple[ElbowArmVectorEnv, NDArray[np.float32]]:
    """An environment whose arms have been reset from each start in turn with all seeds, and its observation."""

    def reset(start: str) -> tuple[ElbowArmVectorEnv, NDArray[np.float32]]:
        arguments = replace(settings, start=start).arguments
        env = ElbowArmVectorEnv(len(seeds), **arguments, autoreset_mode="Disabled")
        return env, env.reset(seed=list(seeds), options=None if options is None else dict(options))[0]

    apart = [reset(start) for start in starts]
    if len(apart) == 1:
        return apart[0]
    env = ElbowArmVectorEnv(len(starts) * len(seeds), **settings.arguments, autoreset_mode="Disabled")
    for i, (one, _) in enumerate(apart):
        env.set_state(one.get_state(), arms=np.arange(len(seeds)) + i * len(seeds))
    return env, np.concatenate([observation for _, observation in apart])


def thinned(run: Recording, period: float) -> Recording:
    """Recording with one instant for every `period` seconds."""
    stride = max(1, round(period / run.time[1]))
    names = [field.name for field in fields(run) if isinstance(getattr(run, field.name), np.ndarray)]
    return replace(run, **{name: getattr(run, name)[::stride].copy() for name in names})

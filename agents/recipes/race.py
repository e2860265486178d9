"""Race of a training against the paper's PD: seconds until the policy needs less energy and errs less."""

from __future__ import annotations

import argparse
import inspect
import math
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.evaluation.players import find_player
from agents.learning.evaluation import controller_evaluation, sentence
from elbow_gym.task.settings import Settings

Actor = Callable[[NDArray[np.float32]], NDArray[Any]]
"""Deterministic actions (B, n) for observations (B, size)."""
AfterUpdate = Callable[[int, Actor], bool]
"""Called by a recipe after each update with the control periods so far, summed over all arms, and the actor. True ends
the training."""
SETTINGS = Settings(elbows=2)
"""Environment of the evaluations: the default one, with two elbows on the table."""

COSTS = ("electrical_energy", "drawn_energy", "steady_electrical_energy", "steady_error_rms_mm", "error_mean_mm")
LOST = {"return": -math.inf, **dict.fromkeys(COSTS, math.inf)}
"""Metrics of an actor that drives the simulation out of what float64 can represent."""


class Mark(NamedTuple):
    """Evaluation of a policy during its training."""

    steps: int
    """Control periods of the training so far, summed over all arms."""
    seconds: float
    """Processor time of the training so far, without evaluations [s]."""
    wall: float
    """Time of the training so far, without evaluations [s]."""
    figures: dict[str, float]
    """Metrics by name, as `agents.learning.evaluation.controller_evaluation` returns them."""


class Race:
    """Evaluates an actor every so many control periods, and tells when it is below the PD in energy and in error.

    Energy is that of the whole run, error the root mean square in 2-5 s, both means over the evaluation seeds.

    Args:
        every: time between two evaluations [control periods], summed over all arms. ValueError unless positive.
        stop: whether the training ends as soon as the PD is beaten.
    """

    def __init__(self, every: int = 50_000, stop: bool = True) -> None:
        if every < 1:
            raise ValueError(f"every must be positive, got {every}")
        self.every, self.stop = every, stop
        self.marks: list[Mark] = []
        self._paused = 0.0, 0.0
        self._start = clocks()

    def __call__(self, steps: int, actor: Actor) -> bool:
        """Evaluates when it is time to. Arguments and result of `AfterUpdate`."""
        last = self.marks[-1].steps if self.marks else 0
        if steps // self.every == last // self.every:
            return False
        now = clocks()
        seconds, wall = (now[k] - self._start[k] - self._paused[k] for k in (0, 1))
        try:
            figures = controller_evaluation(lambda _: _Controller(actor), SETTINGS)
        except ArithmeticError:
            figures = LOST
        self.marks.append(Mark(steps, seconds, wall, figures))
        print(f"{steps:>9,d} steps, {seconds:5.0f} s, {wall:5.0f} s wall: {sentence(figures)}", flush=True)
        over = self.stop and self.beaten is not None
        after = clocks()
        self._paused = self._paused[0] + after[0] - now[0], self._paused[1] + after[1] - now[1]
        return over

    @cached_property
    def pd(self) -> dict[str, float]:
        """The PD's metrics on the evaluation seeds, by name."""
        player = find_player("pd", elbows=2)
        return controller_evaluation(player.make, player.settings)

    @property
    def beaten(self) -> Mark | None:
        """First evaluation below the PD in both energy and error; None when there is none."""
        names = "electrical_energy", "steady_error_rms_mm"
        return next((mark for mark in self.marks if all(mark.figures[name] < self.pd[name] for name in names)), None)

    def verdict(self) -> str:
        """Line that says when the PD was beaten, and the best return."""
        if not self.marks:
            return "no evaluation was made"
        best = max(self.marks, key=lambda mark: mark.figures["return"])
        end = self.marks[-1]
        rate = f"{end.steps / end.seconds:,.0f} steps a second of processor time, training included"
        found = f"best return {best.figures['return']:.1f} (PD {self.pd['return']:.1f}) after {best.seconds:.0f} s"
        if self.beaten is None:
            return f"PD not beaten in {end.steps:,d} steps; {found}; {rate}"
        return f"PD beaten after {self.beaten.steps:,d} steps, {self.beaten.seconds:.0f} s; {found}; {rate}"


class _Controller:
    def __init__(self, actor: Actor) -> None:
        self._actor = actor

    def predict(self, observation: NDArray[np.float32], **_: Any) -> tuple[NDArray[np.float32], None]:
        return np.clip(self._actor(observation), -1.0, 1.0).astype(np.float32), None


def clocks() -> tuple[float, float]:
    """Processor time of this process and time of the clock on the wall [s]."""
    return time.process_time(), time.monotonic()


def main(
    train: Callable[..., Any],
    steps: int,
    algorithms: Sequence[str] = (),
    options: Mapping[str, Any] = MappingProxyType({}),
) -> None:
    """Command line of a recipe: trains, prints every evaluation and the verdict.

    Args:
        train: takes steps, seed and an `AfterUpdate`.
        steps: length of the training where the command line gives none [control periods].
        algorithms: names that `train` takes as `algorithm`, the first by default; none when it takes no such argument.
        options: further arguments that `train` takes, with their defaults.
    """
    parser = argparse.ArgumentParser(description=inspect.getdoc(train))
    parser.add_argument("--steps", type=int, default=steps, help="length of the training, summed over all arms")
    parser.add_argument("--seed", type=int, default=0, help="seed of the environment and the networks")
    parser.add_argument("--every", type=int, default=50_000, help="time between two evaluations")
    parser.add_argument("--to-the-end", action="store_true", help="go on after the PD is beaten")
    if algorithms:
        parser.add_argument("--algorithm", choices=algorithms, default=algorithms[0], help="algorithm of the library")
    for name, default in options.items():
        parser.add_argument(f"--{name}", type=type(default), default=default, help="see the recipe")
    given = parser.parse_args()
    race = Race(given.every, stop=not given.to_the_end)
    more = {name: getattr(given, name) for name in (*options, *(["algorithm"] if algorithms else []))}
    train(given.steps, given.seed, race, **more)
    print(race.verdict())

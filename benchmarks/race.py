"""One training of PPO in the build of this project that the interpreter finds, and where its CPU time goes.

A script of its own, `python race.py ELBOWS SEED SETTINGS ENERGY ERROR`, so that it runs in old builds too. SETTINGS are
JSON, fields of `PPOSettings`. The training ends at the first evaluation below ENERGY [J] and ERROR [mm], and the last
line that it prints is a JSON object. The clock is CPU time of the process; imports and compilation are not counted.
"""

from __future__ import annotations

import importlib
import json
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

PLACES = {
    "callback": ("agents.learning.callback", "agents.keeper"),
    "train": ("agents.learning.train", "agents.train"),
    "run": ("agents.learning.run", "agents.run"),
    "presets": ("agents.learning.presets", "agents.defaults"),
    "env": ("agents.learning.training_env", "agents.metered"),
}
"""Modules by what they hold, of this build and of commit 14328f3."""


def found(names: tuple[str, ...]) -> Any:
    """The first of these modules that there is."""
    for name in names[:-1]:
        try:
            return importlib.import_module(name)
        except ModuleNotFoundError:
            continue
    return importlib.import_module(names[-1])


class Watch:
    """CPU time inside functions, by name [s]; a call inside another counts for both."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def on(self, kind: Any, name: str, after: Callable[..., None] = lambda *_: None) -> None:
        """Counts the calls of a method of a class, and calls `after` with its arguments afterwards."""
        method = getattr(kind, name)

        def timed(*arguments: Any, **more: Any) -> Any:
            begun = time.process_time()
            try:
                return method(*arguments, **more)
            finally:
                self.seconds[name] = self.seconds.get(name, 0.0) + time.process_time() - begun
                after(*arguments)

        setattr(kind, name, timed)


def race(elbows: int, seed: int, folder: Path, settings: dict[str, Any], goal: tuple[float, float]) -> dict[str, Any]:
    """Trains one seed and says how long it took.

    Args:
        elbows: number of elbows on the table.
        seed: seed of the training.
        folder: folder of the run, which must not exist.
        settings: fields of `PPOSettings` in place of the task's.
        goal: energy [J] and error [mm] that end the training once it is below both.
    """
    callback, train, run, presets, env = (found(names) for names in PLACES.values())
    chosen = replace(presets.default_settings("ppo", f"elbows{elbows}"), **settings)
    one = run.Run(algorithm="ppo", environment={"elbows": elbows}, settings=chosen, seed=seed, folder=folder)
    # Compiled before, so that nothing but the training is counted.
    train.train(replace(one, settings=replace(chosen, total_timesteps=1), folder=folder.with_name("warm")))
    callback.time = SimpleNamespace(monotonic=time.process_time)
    beaten: list[float] = []
    seconds: list[float] = []

    def look(keeper: Any, *_: Any) -> None:
        row, seconds[:] = keeper._rows[-1], keeper.seconds
        if not beaten and row[4] < goal[0] and row[7] < goal[1]:
            beaten.extend(row[:3])
            raise KeyboardInterrupt

    watch = Watch()
    watch.on(callback.Keeper, "evaluate", look)
    watch.on(callback.Keeper, "checkpoint")
    watch.on(chosen.model_class, "train")
    watch.on(env.MeteredVectorEnv, "step")
    result = train.train(one)
    parts = dict.fromkeys(("step", "train", "evaluate", "checkpoint"), 0.0) | watch.seconds
    return {
        "arms": chosen.num_envs,
        "steps": result["steps"],
        "training_seconds": seconds[0],
        "arms_seconds": parts["step"],
        "rollout_seconds": seconds[0] - parts["step"] - parts["train"],
        "update_seconds": parts["train"],
        "evaluation_seconds": parts["evaluate"],
        "checkpoint_seconds": parts["checkpoint"],
        "beaten_after": beaten,
        "best_return": result["best"]["return"],
    }


if __name__ == "__main__":
    words = sys.argv[1:]
    with tempfile.TemporaryDirectory() as place:
        target = float(words[3]), float(words[4])
        print(json.dumps(race(int(words[0]), int(words[1]), Path(place) / "run", json.loads(words[2]), target)))

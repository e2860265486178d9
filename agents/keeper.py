"""The callback of a training run: evaluates, checkpoints, and keeps the best policy."""

from __future__ import annotations

import os
import platform
import sys
import time
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from tqdm import tqdm

from agents.files import write_whole
from agents.metrics import metrics
from agents.policy import Policy, policy_of
from agents.recording import record
from elbow_gym.settings import Settings

EVALUATION_SEEDS = tuple(range(10_000, 10_008))
"""Seeds that choose the best policy while it trains; the benchmark's own seeds are others."""
PACKAGES = ("elbow-gym", "stable-baselines3", "torch", "gymnasium", "numpy", "numba")


class Keeper(BaseCallback):
    """Evaluates every so many control periods and keeps what was best by return.

    Args:
        settings: the environment.
        algorithm: the algorithm's settings, a dataclass.
        seed: the run's.
        folder: where `best.*` and `checkpoint.zip` go.
        every: control periods between two evaluations.
        minutes: ends the training after so many; None for no limit.
    """

    def __init__(
        self, settings: Settings, algorithm: Any, seed: int, folder: Path, every: int, minutes: float | None
    ) -> None:
        super().__init__()
        self._settings, self._algorithm, self._seed = settings, algorithm, seed
        self._folder, self._every, self._minutes = folder, every, minutes
        self._started = time.monotonic()
        self._evaluated = -1
        self._best: Policy | None = None
        self._best_return = -np.inf
        self._bar = tqdm(total=algorithm.total_timesteps, unit="step", unit_scale=True, disable=None)

    @property
    def best(self) -> Policy:
        """The policy with the best return so far."""
        if self._best is None:
            raise RuntimeError("no policy was evaluated yet")
        return self._best

    def _on_step(self) -> bool:
        return self._minutes is None or time.monotonic() - self._started < 60.0 * self._minutes

    def _on_rollout_start(self) -> None:
        if self.num_timesteps // self._every > self._evaluated // self._every:
            self.evaluate(self.model)
            write_whole(self._folder / "checkpoint.zip", self.model.save)

    def _on_rollout_end(self) -> None:
        self._bar.update(self.num_timesteps - self._bar.n)

    def finish(self, model: BaseAlgorithm) -> None:
        """The last evaluation, after the training or its interruption."""
        self._bar.close()
        self.evaluate(model)

    def evaluate(self, model: BaseAlgorithm) -> None:
        """Plays the deterministic policy on the evaluation seeds; says what came out and keeps the best."""
        if self.num_timesteps == self._evaluated:
            return
        self._evaluated = self.num_timesteps
        seconds = time.monotonic() - self._started
        policy = policy_of(
            model,
            self._settings,
            command=" ".join(["python -m agents", *sys.argv[1:]]),
            training={
                **asdict(self._algorithm),
                "seed": self._seed,
                "timesteps": self.num_timesteps,
                "seconds": round(seconds, 1),
                "machine": f"{platform.machine()}, {os.cpu_count()} cores",
            },
            versions={name: version(name) for name in PACKAGES},
        )
        figures = evaluation(policy, self._settings)
        for name, value in figures.items():
            model.logger.record(f"evaluation/{name}", value)
        tqdm.write(f"{self.num_timesteps:>9,d} steps, {seconds:4.0f} s: {sentence(figures)}")
        if figures["return"] > self._best_return:
            self._best_return = figures["return"]
            policy.card.evaluation.update(figures, seeds=list(EVALUATION_SEEDS))
            policy.save(self._folder / "best")
            self._best = policy


def evaluation(policy: Policy, settings: Settings) -> dict[str, float]:
    """Means over the evaluation seeds, by name; "steady" counts the last 60 % of the episode, 2-5 s by default."""
    recording = record(settings, lambda _: policy, EVALUATION_SEEDS)
    whole, steady = metrics(recording), metrics(recording, 0.4 * recording.time[-1])
    return {
        "return": float(whole["return"].mean()),
        "electrical_energy": float(whole["electrical_energy"].mean()),
        "steady_electrical_energy": float(steady["electrical_energy"].mean()),
        "steady_error_rms_mm": float(np.sqrt((steady["error_rms"] ** 2).mean())),
    }


def sentence(figures: dict[str, float]) -> str:
    """The evaluation's figures in a line."""
    return (
        f"return {figures['return']:.2f}, {figures['electrical_energy']:.1f} J in all, "
        f"{figures['steady_electrical_energy']:.1f} J and {figures['steady_error_rms_mm']:.2f} mm rms when steady"
    )

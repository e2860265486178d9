"""Callback of a training run, which evaluates, saves checkpoints and keeps the best policy."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback

from agents.jobs.job import Tell, unwanted
from agents.learning.actor import policy_of
from agents.learning.checkpoint import save_checkpoint
from agents.learning.evaluation import evaluation, evaluation_row, evaluation_seeds, sentence
from agents.learning.run import Run
from agents.learning.run_folder import Checkpoint
from agents.learning.training_env import MeteredVectorEnv
from elbow_gym.baselines.policy import Policy
from elbow_gym.task.settings import Settings

NEW: dict[str, Any] = {"steps": 0, "evaluated": -1, "training_seconds": 0.0, "wall_seconds": 0.0, "evaluations": []}
"""Progress of a run that has just begun."""


class PausedError(Exception):
    """A training has come as far as was asked for, and its checkpoint is written."""


class Keeper(BaseCallback):
    """Evaluates by control periods, keeps the policy with the best return, and saves checkpoints by the clock.

    Args:
        run: the run.
        env: the batched environment under the model's.
        found: checkpoint that the run goes on from; None for a new run.
        tell: hears of the control periods that are made, and of each evaluation in a line.
        until: control periods after which `PausedError` is raised; never when None.
    """

    def __init__(
        self, run: Run, env: MeteredVectorEnv, found: Checkpoint | None, tell: Tell, until: int | None = None
    ) -> None:
        super().__init__()
        self._run, self._env, self._settings = run, env, Settings(**run.environment)
        progress = NEW if found is None else found.progress()
        self._evaluated, self._first = progress["evaluated"], progress["steps"]
        self._training, self._wall = progress["training_seconds"], progress["wall_seconds"]
        self._rows: list[list[float]] = list(progress["evaluations"])
        self._now = self._saved = time.monotonic()
        self._best = None
        if found is not None:
            self._best = run.files.restore_best(found)
            run.files.write_evaluations(self._rows)
        self._tell, self._told, self._until = tell, 0, until

    @property
    def best(self) -> Policy:
        """Policy with the best return so far. Raises RuntimeError before the first evaluation."""
        if self._best is None:
            raise RuntimeError("no policy was evaluated yet")
        return self._best

    @property
    def seconds(self) -> tuple[float, float]:
        """Time of the training without evaluations and checkpoints, and in all [s]."""
        return self._training, self._wall

    def tick(self, training: bool) -> None:
        """Counts the time since the last call to the training, or only to all."""
        now = time.monotonic()
        self._wall += now - self._now
        self._training += now - self._now if training else 0.0
        self._now = now

    def show(self, steps: int) -> None:
        """Tells how many control periods are made. KeyboardInterrupt where the run is `unwanted`."""
        if unwanted():
            raise KeyboardInterrupt
        try:
            self._tell(steps - self._told)
        except InterruptedError as error:
            raise KeyboardInterrupt from error
        self._told = steps

    def _on_step(self) -> bool:
        if unwanted():
            raise KeyboardInterrupt
        spent = self._wall + time.monotonic() - self._now
        return self._run.minutes is None or spent < 60.0 * self._run.minutes

    def _on_rollout_start(self) -> None:
        done = self.num_timesteps / self._run.settings.total_timesteps
        self._env.set_energy_weight(self._run.settings.energy_share(done) * self._settings.energy_weight)
        self._run.settings.follow_plan(self.model, done)
        every = self._run.settings.evaluate_every
        if self.num_timesteps // every > self._evaluated // every:
            self.evaluate(self.model)
        paused = self._until is not None and self.num_timesteps >= self._until
        if paused or time.monotonic() - self._saved > self._run.checkpoint_seconds:
            self.checkpoint(self.model)
        if paused:
            raise PausedError

    def _on_rollout_end(self) -> None:
        self.show(self.num_timesteps)
        # Less than an episode would show now its reach, now its tracking.
        if self._env.metered_periods >= self._settings.horizon * self._env.num_envs:
            for name, mean in self._env.read_meters().items():
                # Rewards as an episode sums them up, next to its return.
                scale = self._settings.horizon if name.startswith("reward") else 1.0
                self.logger.record(f"rollout/{name}", scale * mean)

    def finish(self, model: BaseAlgorithm) -> None:
        """Makes the last evaluation and checkpoint, after the training or its interruption."""
        self.evaluate(model)
        if model.num_timesteps < self._run.settings.total_timesteps:
            # Stopped between an action and its outcome: whoever goes on starts new episodes.
            model._last_obs = None
        self.checkpoint(model)

    def checkpoint(self, model: BaseAlgorithm) -> None:
        """Saves all that a resumed run needs."""
        self.tick(training=True)
        progress = {
            "steps": model.num_timesteps,
            "evaluated": self._evaluated,
            "training_seconds": self._training,
            "wall_seconds": self._wall,
            "evaluations": self._rows,
        }
        save_checkpoint(self._run.files, model, model.get_env(), progress, self._best)
        self.tick(training=False)
        self._saved = self._now

    def evaluate(self, model: BaseAlgorithm) -> None:
        """Plays the deterministic policy on the evaluation seeds, prints the metrics and keeps the best policy."""
        if model.num_timesteps == self._evaluated:
            return
        self.tick(training=True)
        training = {"timesteps": model.num_timesteps, "seconds": round(self._training, 1)}
        policy = policy_of(model, self._settings, **self._run.card(training))
        figures = evaluation(policy, self._settings)
        for name, value in figures.items():
            model.logger.record(f"evaluation/{name}", value)
        if self._best is None or figures["return"] > self._best.card.evaluation["return"]:
            policy.card.evaluation.update(figures, seeds=list(evaluation_seeds(self._settings)))
            self._run.files.write_best(policy)
            self._best = policy
        # Whoever is interrupted before makes the evaluation again, and has a policy in any case.
        self._rows.append(evaluation_row(model.num_timesteps, self._training, self._wall, figures))
        self._evaluated = model.num_timesteps
        self._run.files.write_evaluations(self._rows)
        self._say(model.num_timesteps, figures)
        self.tick(training=False)

    def _say(self, steps: int, figures: Mapping[str, float]) -> None:
        done = max(1, steps - self._first)
        left = self._wall * (self._run.settings.total_timesteps - steps) / done if steps > self._first else math.nan
        eta = f", {left / 60:.0f} min left" if left > 0.0 else ""
        self._tell(0, f"{self._run.name}: {steps:>9,d} steps, {self._training:4.0f} s{eta}: {sentence(figures)}")

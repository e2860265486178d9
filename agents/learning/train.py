"""Training of Stable-Baselines3 agents on the batched environment: one run here, several side by side in processes."""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

from agents.learning.checkpoint import load_checkpoint
from agents.learning.run import Run
from agents.learning.sac.settings import SACSettings
from agents.workers import compile_before
from elbow_gym.task.settings import Settings

SEED_STRIDE = 1_000_000
"""Arm i of a run with seed s draws from seed s * SEED_STRIDE + i: no two runs share an arm, nor an evaluation's."""


def train(run: Run, resume: bool = False, position: int = 0) -> dict[str, Any]:
    """Trains one seed; Ctrl-C ends it and keeps the best policy so far.

    Writes what `RunFolder` lists: the best policy each time an evaluation improves, a row per evaluation, a checkpoint
    by the clock, TensorBoard logs, and the result at the end.

    Args:
        run: what is trained.
        resume: go on from the folder's latest checkpoint; a run that has made all its steps is left alone. Without a
            checkpoint it starts anew.
        position: line of the progress bar on the terminal, from 0.

    Returns:
        Name, seed, control periods and seconds of the run, and the metrics of its best evaluation.

    Raises:
        ValueError: the folder holds a run and `resume` is not set, or a run with other settings.
    """
    import torch
    from stable_baselines3.common.vec_env import VecMonitor

    from agents.learning.callback import Keeper
    from agents.learning.training_env import MeteredVectorEnv
    from elbow_gym.sb3 import SB3VecEnv

    files, total = run.files, run.settings.total_timesteps
    files.open(run.record(), resume)
    found = files.checkpoint()
    progress = None if found is None else found.progress()
    result = files.result()
    over = progress is not None and (progress["steps"] >= total or _out_of_time(run, progress))
    # A kill between the last checkpoint and the result leaves the result to be made.
    if over and result is not None and result["finished"]:
        return result
    # Small networks lose more by handing work between threads than they gain.
    torch.set_num_threads(1)
    settings = Settings(**run.environment)
    env = MeteredVectorEnv(run.settings.num_envs, **run.settings.training_arguments(settings.arguments))
    monitored = VecMonitor(SB3VecEnv(env))
    if found is not None:
        model = load_checkpoint(found, run.settings.model_class, monitored)
    else:
        model = run.settings.model(monitored, run.seed, files.tensorboard)
        monitored.seed(run.seed * SEED_STRIDE)
    keeper = Keeper(run, env, progress, position)
    try:
        if found is None:
            _prepare(run, model, env, keeper)
        env.staggered = True
        remaining = total - model.num_timesteps
        model.learn(remaining, callback=keeper, log_interval=run.settings.log_interval, reset_num_timesteps=False)
    except KeyboardInterrupt:
        print(f"{run.name}: interrupted; keeping the best policy so far", file=sys.stderr)
    keeper.finish(model)
    training, wall = keeper.seconds
    result = {
        "name": run.name,
        "seed": run.seed,
        "steps": model.num_timesteps,
        "finished": model.num_timesteps >= total or (run.minutes is not None and wall >= 60.0 * run.minutes),
        "training_seconds": round(training, 1),
        "wall_seconds": round(wall, 1),
        "best": keeper.best.card.evaluation,
    }
    files.write_result(result)
    return result


def _out_of_time(run: Run, progress: dict[str, Any]) -> bool:
    return run.minutes is not None and progress["wall_seconds"] >= 60.0 * run.minutes


def _prepare(run: Run, model: Any, env: Any, keeper: Any) -> None:
    """Gives the model what the training starts from: a policy's weights, or a demonstration and its imitation."""
    if run.initial_policy is not None:
        from agents.learning.warm_start import take_over
        from elbow_gym.baselines.policy import read_policy

        take_over(model, read_policy(run.initial_policy))
    if isinstance(run.settings, SACSettings) and run.settings.warm_start != "uniform":
        from agents.learning.warm_start import fill, imitate

        shown = fill(model, run.settings, env, run.seed, keeper.show)
        if len(shown.actions) and run.initial_policy is None:
            imitate(model, shown, run.settings.imitation_steps, run.seed)


def train_all(runs: Sequence[Run], workers: int = 2, resume: bool = False) -> list[dict[str, Any]]:
    """Trains several runs, `workers` of them at a time in processes, and returns the results in their order.

    Raises:
        ValueError: there are no runs, `workers` is not positive, or a folder holds a run and `resume` is not set, or a
            run with other settings; no run starts then.
    """
    if not runs:
        raise ValueError("runs must be at least one, got none")
    if workers < 1:
        raise ValueError(f"workers must be positive, got {workers}")
    for run in runs:
        run.files.check(run.record(), resume)
    trained = Settings(**runs[0].environment)
    compile_before([(trained, runs[0].settings.num_envs), trained])
    if workers == 1 or len(runs) == 1:
        return [train(run, resume, 0) for run in runs]
    from tqdm import tqdm

    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    context = multiprocessing.get_context("spawn")
    lock = context.RLock()
    with ProcessPoolExecutor(min(workers, len(runs)), context, tqdm.set_lock, (lock,)) as pool:
        futures = [pool.submit(train, run, resume, k) for k, run in enumerate(runs)]
        try:
            return [future.result() for future in futures]
        except KeyboardInterrupt:
            pool.shutdown(wait=True, cancel_futures=True)
            raise

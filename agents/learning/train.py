"""Training of Stable-Baselines3 agents on the batched environment: one run here, several side by side in processes."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from agents.cli import forget_lost_terminal, sentence
from agents.files import check_space, check_writable
from agents.jobs.bar import Bar
from agents.jobs.job import Job, Tell
from agents.jobs.machines import Machines
from agents.learning.checkpoint import buffer_size, check_versions, load_checkpoint
from agents.learning.checkpoint_folder import Checkpoint
from agents.learning.evaluation import sentence as figures_sentence
from agents.learning.run import Run
from agents.learning.run_folder import KEPT
from agents.learning.sac.settings import SACSettings
from agents.learning.threads import one_thread
from agents.workers import compile_before, cores
from elbow_gym.task.settings import Settings

SEED_STRIDE = 1_000_000
"""Arm i of a run with seed s draws from seed s * SEED_STRIDE + i: no two runs share an arm, nor an evaluation's."""


def train(run: Run, resume: bool = False, tell: Tell = lambda *_: None, until: int | None = None) -> dict[str, Any]:
    """Trains one seed; Ctrl-C ends it and keeps the best policy so far.

    Writes what `RunFolder` lists: the best policy each time an evaluation improves, a row per evaluation, a checkpoint
    by the clock, TensorBoard logs, and the result at the end. Torch computes with one thread meanwhile.

    Args:
        run: what is trained.
        resume: go on from the folder's latest checkpoint that is whole; a run that has made all its steps is left
            alone. Without a checkpoint it starts anew.
        tell: hears of the control periods that are made, and of each evaluation in a line.
        until: control periods after which the training pauses, with a checkpoint from which it goes on to the same
            bits; it is trained to its end when None.

    Returns:
        Name, seed, control periods and seconds of the run, and the metrics of its best evaluation; those are None
        where the run was interrupted before its first.

    Raises:
        ValueError: the folder holds a run and `resume` is not set, a run with other settings or of other versions of
            the libraries, or damaged files that nothing replaces.
        OSError: the folder cannot be written any more. Its files are those of the last checkpoint.
    """
    from stable_baselines3.common.vec_env import VecMonitor

    from agents.learning.callback import Keeper, PausedError
    from agents.learning.training_env import MeteredVectorEnv
    from elbow_gym.sb3 import SB3VecEnv

    files, total = run.files, run.settings.total_timesteps
    files.check(run.record(), resume)
    found = files.checkpoint()
    result = _result(run, found)
    if result is not None:
        return result
    settings = Settings(**run.environment)
    with one_thread(), _errors_once(files.path):
        env = MeteredVectorEnv(run.settings.num_envs, **run.settings.training_arguments(settings.arguments))
        monitored = VecMonitor(SB3VecEnv(env))
        if found is not None:
            check_versions(found)
            model = load_checkpoint(found, run.settings.model_class, monitored)
        else:
            model = run.settings.model(monitored, run.seed, files.tensorboard)
            monitored.seed(run.seed * SEED_STRIDE)
        # One more than is kept lies there while it is written.
        check_space(files.path.parent, (1 + KEPT) * buffer_size(model))
        files.open(run.record(), resume)
        keeper = Keeper(run, env, found, tell, until)
        begun, paused = found is not None, False
        try:
            if not begun:
                _prepare(run, model, env, keeper)
                begun = True
            env.staggered = True
            remaining = total - model.num_timesteps
            model.learn(remaining, callback=keeper, log_interval=run.settings.log_interval, reset_num_timesteps=False)
        except PausedError:
            paused = True
        except KeyboardInterrupt:
            forget_lost_terminal()
            print(f"{run.name}: interrupted; keeping the best policy so far", file=sys.stderr)
        if begun and not paused:
            keeper.finish(model)
    training, wall = keeper.seconds
    result = {
        "name": run.name,
        "seed": run.seed,
        # Half a preparation is no start to go on from: it is made anew.
        "steps": model.num_timesteps if begun else 0,
        "finished": model.num_timesteps >= total or (run.minutes is not None and wall >= 60.0 * run.minutes),
        "training_seconds": round(training, 1),
        "wall_seconds": round(wall, 1),
        "best": keeper.best.card.evaluation if begun else None,
    }
    if not paused:
        files.write_result(result)
    return result


def _result(run: Run, found: Checkpoint | None) -> dict[str, Any] | None:
    """The result of a run that is over; None where it goes on, or a kill before the result leaves that to be made."""
    progress, result = None if found is None else found.progress(), run.files.result()
    over = progress is not None and (progress["steps"] >= run.settings.total_timesteps or _out_of_time(run, progress))
    return result if over and result is not None and result.get("finished") else None


@contextmanager
def _errors_once(folder: Path) -> Iterator[None]:
    """Gives the system's errors the folder's name where they have none, and has TensorBoard's thread not print its own.

    The thread keeps its error, and raises it again here with the next entry.
    """
    before = threading.excepthook
    threading.excepthook = lambda failed: None if isinstance(failed.exc_value, OSError) else before(failed)
    try:
        yield
    except OSError as error:
        if error.errno is not None and error.filename is None:
            error.filename = str(folder)
        raise
    finally:
        threading.excepthook = before


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


def train_all(runs: Sequence[Run], machines: Machines | None = None, resume: bool = False) -> list[dict[str, Any]]:
    """Trains several runs side by side with one progress bar, and prints a line about each at its end.

    Ctrl-C, or SIGTERM and SIGHUP under `agents.cli.Commands`, ends all of them; each keeps its best policy so far. A
    run that fails leaves the others going on.

    Args:
        runs: what is trained.
        machines: where; processes of this machine when None. A single run, or a single worker's, are trained in this
            process.
        resume: as in `train`.

    Returns:
        The results in the runs' order.

    Raises:
        ValueError: there are no runs, or a folder holds a run and `resume` is not set, a run with other settings, or
            damaged files; no run starts then.
        OSError: a folder cannot be written, before or while its run trains.
        KeyboardInterrupt: the runs were interrupted.
    """
    if not runs:
        raise ValueError("runs must be at least one, got none")
    machines = machines or Machines()
    for run in runs:
        run.files.check(run.record(), resume)
    for run in runs:
        check_writable(run.folder)
    compile_before(batches(runs), compilations(runs))
    apart = machines.ray is not None or min(machines.workers or cores(), len(runs)) > 1
    with Bar(sum(run.settings.total_timesteps for run in runs), "step") as bar:
        outcomes = _side_by_side(runs, machines, bar) if apart else _one_by_one(runs, resume, bar)
    for run, one in zip(runs, outcomes, strict=True):
        print(_line(run, one), flush=True)
    for one in outcomes:
        if isinstance(one, Exception):
            raise one
    if any(one is None or not one["finished"] for one in outcomes):
        raise KeyboardInterrupt
    return outcomes


def compilations(runs: Sequence[Run]) -> dict[Callable[[], None], int]:
    """Calls that compile what the learning itself needs and their seconds, for `compile_before`."""
    from agents.learning.compiled import COMPILE_SECONDS
    from agents.learning.fit import compile_fit
    from agents.learning.ppo.gradient import compile_loops

    needed = {"ppo": compile_loops, "sac": compile_fit}
    return {needed[run.algorithm]: COMPILE_SECONDS for run in runs if run.algorithm in needed}


def batches(runs: Sequence[Run]) -> list[tuple[Settings, int] | Settings]:
    """Environments of the runs' trainings and evaluations, for `compile_before`."""
    trained = [(Settings(**run.environment), run.settings.num_envs) for run in runs]
    return [one for settings, arms in trained for one in ((settings, arms), settings)]


def _one_by_one(runs: Sequence[Run], resume: bool, tell: Tell) -> list[Any]:
    outcomes: list[Any] = []
    for run in runs:
        outcomes.append(_attempt(run, resume, tell))
        if isinstance(outcomes[-1], dict) and not outcomes[-1]["finished"]:
            break
    return outcomes + [None] * (len(runs) - len(outcomes))


def _attempt(run: Run, resume: bool, tell: Tell) -> Any:
    try:
        return train(run, resume, tell)
    except Exception as error:
        return error


def _side_by_side(runs: Sequence[Run], machines: Machines, tell: Tell) -> list[Any]:
    outcomes: dict[int, Any] = {}
    with machines.pool(len(runs)) as pool:
        for k, run in enumerate(runs):
            # The folders are checked: a run in one of them is this one, which another worker has begun.
            work = partial(train, run, True)
            pool.submit(k, Job(work, run.settings.total_timesteps, run.name, run.folder))
        try:
            outcomes.update(pool.outcomes(tell))
        except KeyboardInterrupt:
            pool.stop()
            # Whoever does not end in time is killed on purpose.
            ended = pool.outcomes(tell)
            outcomes.update((k, None if isinstance(one, ChildProcessError) else one) for k, one in ended)
    return [outcomes[k] for k in range(len(runs))]


def _line(run: Run, ended: Any) -> str:
    """What came of a run: its result, its error, or None."""
    if ended is None:
        return f"{run.name}: stopped; --resume goes on from its last checkpoint, or starts it"
    if isinstance(ended, Exception):
        return f"{run.name}: failed: {sentence(ended) or type(ended).__name__}"
    state = "finished" if ended["finished"] else "not finished"
    best = "no policy yet" if ended["best"] is None else f"best: {figures_sentence(ended['best'])}"
    return f"{run.name}: {state} after {ended['steps']:,d} steps, {best}"

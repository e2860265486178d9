"""Commands that train: `python -m agents train`, `python -m agents clone` and `python -m agents newton`."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Union

import tyro
from tyro.conf import OmitArgPrefixes, Positional, arg, subcommand

from agents.cli import Count, Seed, spelled
from agents.jobs.machines import Machines
from agents.learning.clone_settings import CloneSettings
from agents.learning.newton.settings import NewtonSettings
from agents.learning.presets import ALGORITHMS, default_settings
from agents.learning.settings import AlgorithmSettings
from agents.task_options import TaskOptions
from agents.tasks import RUNS, plain_arguments

if TYPE_CHECKING:
    from agents.learning.run import Run
    from elbow_gym.baselines.policy import Policy

REQUIRED = "(required)"


@dataclass(frozen=True, kw_only=True)
class Seeds:
    """Seeds of the networks and their runs, a folder each."""

    seeds: Count = 1
    """Number of seeds."""
    first_seed: Seed = 0
    """First seed; the others follow it."""
    resume: bool = False
    """Whether runs go on, from their last checkpoint where they have one; finished ones are left alone.
    Without it, a folder that holds a run is refused."""
    output: Path = RUNS
    """Folder in which each run gets its own."""

    @property
    def all(self) -> range:
        """The seeds."""
        return range(self.first_seed, self.first_seed + self.seeds)


@dataclass(frozen=True, kw_only=True)
class Schedule(Seeds):
    """Number, duration and folders of the runs."""

    label: str = ""
    """Word in the folders' names after the algorithm, such as "cloned", for runs that differ from the plain ones."""
    initial_policy: Path | None = None
    """Policy whose weights the actor starts from; random weights, or those of a demonstration, when None."""
    minutes: float | None = None
    """Longest duration of each run [min], evaluations included; no limit when None."""
    checkpoint_seconds: float = 60.0
    """Time between two checkpoints of a run [s]."""


@dataclass(frozen=True, kw_only=True)
class Teacher:
    """Optimal trajectory to clone, and the environment that it is for."""

    elbows: int = 2
    """Number of elbows on the table."""
    trajectory: Path | None = None
    """File of the trajectory, as `python -m benchmarks optimal` writes it; the shipped one for the elbows when None."""


@dataclass(frozen=True, kw_only=True)
class Lead(Seeds):
    """Number and folders of the runs, and what drives at first."""

    initial_policy: Path | None = None
    """Policy that drives in the first rounds; the shipped PPO of drawn arms, or of the number of elbows, when None."""

    def first(self, task: TaskOptions) -> Policy:
        """The initial policy of a task. Raises ValueError where none is given and none shipped."""
        from elbow_gym.baselines.policy import load_policy

        if self.initial_policy is not None:
            return load_policy(self.initial_policy)
        if task.elbows in (None, 2):
            return load_policy("ppo", env="ElbowArmRandom-v0")
        if not isinstance(task.elbows, int):
            raise ValueError(f"--initial-policy must be given for the elbows {task.elbows}, got None")
        return load_policy("ppo", elbows=task.elbows)


DRAWN, LEAD, MACHINES, NEWTON = TaskOptions(env="ElbowArmTasks-v0"), Lead(), Machines(), NewtonSettings()


def train_command(words: Sequence[str]) -> Callable[..., None]:
    """The command `train`, whose algorithm options have the defaults of the task that the words name."""

    def train(
        task: OmitArgPrefixes[TaskOptions],
        run: OmitArgPrefixes[Schedule],
        machines: OmitArgPrefixes[Machines],
        algorithm: AlgorithmSettings,
    ) -> None:
        """Trains agents, several seeds side by side; Ctrl-C keeps the best policies so far.

        Each seed has a folder OUTPUT/ALGORITHM[_LABEL]_TASK_seedK with its best policy, evaluations.csv, checkpoints
        and TensorBoard logs. `train ppo --help` lists the options of PPO.
        """
        from agents.learning.train import train_all

        run = replace(run, output=machines.place(run.output))
        runs = runs_of(task, run, algorithm, spelled("agents", "train", words))
        names = " to ".join(dict.fromkeys((runs[0].name, runs[-1].name)))
        print(f"{names}, into {run.output}: {algorithm}", flush=True)
        train_all(runs, machines, run.resume)

    # The defaults follow from the task, and are known only now.
    train.__annotations__["algorithm"] = _algorithms(_named_task(words))
    return train


def clone_command(words: Sequence[str]) -> Callable[..., None]:
    """The command `clone`."""

    def clone(
        teacher: OmitArgPrefixes[Teacher],
        run: OmitArgPrefixes[Seeds],
        machines: OmitArgPrefixes[Machines],
        imitation: OmitArgPrefixes[CloneSettings],
    ) -> None:
        """Clones the optimal trajectory and the LQR around it into networks, several seeds side by side.

        Each seed has a folder OUTPUT/clone_elbowsN_seedK with its best policy and evaluations.csv.
        """
        from agents.learning.clone import clone_all
        from agents.shipped import OPTIMA
        from elbow_gym.task.settings import Settings

        settings = Settings(elbows=teacher.elbows)
        output = machines.place(run.output)
        folders = [output / f"clone_elbows{teacher.elbows}_seed{seed}" for seed in run.all]
        source = OPTIMA / f"elbows{teacher.elbows}.npz" if teacher.trajectory is None else teacher.trajectory
        command = spelled("agents", "clone", words)
        results = clone_all(settings, source, imitation, list(run.all), folders, command, run.resume, machines)
        for result in results.values():
            print(f"{result['name']}: {result['training_seconds']:.0f} s, return {result['best']['return']:.2f}")

    return clone


def newton_command(words: Sequence[str]) -> Callable[..., None]:
    """The command `newton`."""

    def newton(
        task: OmitArgPrefixes[TaskOptions] = DRAWN,
        run: OmitArgPrefixes[Lead] = LEAD,
        machines: OmitArgPrefixes[Machines] = MACHINES,
        imitation: OmitArgPrefixes[NewtonSettings] = NEWTON,
    ) -> None:
        """Trains one policy for drawn tasks on Newton's steps from its own motions, several seeds side by side.

        Each seed has a folder OUTPUT/newton_TASK_seedK with its best policy, evaluations.csv and a checkpoint.
        """
        from agents.learning.newton.runs import newton_all
        from elbow_gym.task.settings import Settings

        output = machines.place(run.output)
        folders = {seed: output / f"newton_{task.name}_seed{seed}" for seed in run.all}
        settings = Settings(**plain_arguments(task.settings()))
        command = spelled("agents", "newton", words)
        results = newton_all(settings, task.env, run.first(task), imitation, folders, command, run.resume, machines)
        for result in results.values():
            print(f"{result['name']}: {result['training_seconds']:.0f} s, return {result['best']['return']:.2f}")

    return newton


def publish_command(words: Sequence[str]) -> Callable[..., None]:
    """The command `publish`."""
    del words

    def publish(
        runs: Annotated[tuple[Path, ...], Positional, arg(metavar="FOLDER [FOLDER ...]", help_behavior_hint=REQUIRED)],
        /,
        replace_seeds: bool = False,
        allow_worse: bool = False,
    ) -> None:
        """Takes finished runs over into the shipped policies and learning curves; a task's best seed is its baseline.

        Args:
            runs: Folders of the runs, as the training named them.
            replace_seeds: Whether to remove the shipped seeds of the same algorithm and task that are not among the
                runs.
            allow_worse: Whether a shipped policy may give way to one with a worse return; otherwise that is refused.
        """
        from agents.learning.publish import publish as publish_runs

        for name in publish_runs(runs, replace_seeds=replace_seeds, allow_worse=allow_worse):
            print(name)

    return publish


def runs_of(task: TaskOptions, schedule: Schedule, settings: AlgorithmSettings, command: str) -> list[Run]:
    """The runs that a command line asks for, one a seed.

    Raises:
        ValueError: an argument of the environment or of the runs is wrong, or there is no such initial policy.
    """
    from agents.learning.run import Run
    from elbow_gym.baselines.policy import read_policy

    policy = schedule.initial_policy
    if policy is not None:
        if not policy.is_file() and not policy.with_name(f"{policy.name}.json").is_file():
            raise ValueError(f"--initial-policy must be the path of a policy's files, got {policy}")
        read_policy(policy)
    algorithm = next(name for name, kind in ALGORITHMS.items() if isinstance(settings, kind))
    name = "_".join(part for part in (algorithm, schedule.label, task.name) if part)
    first = Run(
        algorithm=algorithm,
        env=task.env,
        environment=json.loads(json.dumps(task.settings().arguments)),
        settings=settings,
        seed=schedule.first_seed,
        folder=schedule.output,
        minutes=schedule.minutes,
        checkpoint_seconds=schedule.checkpoint_seconds,
        initial_policy=schedule.initial_policy,
        command=command,
    )
    return [replace(first, seed=seed, folder=schedule.output / f"{name}_seed{seed}") for seed in schedule.all]


def _algorithms(task: str) -> Any:
    """The algorithms as tyro's subcommands, with their settings for a task as defaults."""
    defaults = {name: default_settings(name, task) for name in ALGORITHMS}
    kinds = [
        Annotated[
            type(default),
            subcommand(name, default=default, description=_first_line(type(default)), prefix_name=False),
            OmitArgPrefixes,
        ]
        for name, default in defaults.items()
    ]
    return Union[tuple(kinds)]  # noqa: UP007  their number is known only here


def _named_task(words: Sequence[str]) -> str:
    """Name of the task that a command line asks for; the usual one where it is wrong, which the whole parse reports."""
    try:
        with redirect_stderr(io.StringIO()):
            task, _ = tyro.cli(TaskOptions, args=words, return_unknown_args=True, add_help=False)
        return task.name
    except (SystemExit, ValueError):
        return TaskOptions().name


def _first_line(documented: Any) -> str:
    return documented.__doc__.split("\n")[0]

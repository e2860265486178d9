"""`python -m agents train`: its defaults depend on the algorithm and the task that the same line names."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from agents.learning.presets import ALGORITHMS, default_settings
from agents.learning.settings import AlgorithmSettings
from agents.tasks import task_settings
from elbow_gym.baselines.tasks import task_name


def train_command(line: Sequence[str]) -> Callable[..., None]:
    """The command as a function whose settings have the defaults for the algorithm and task named in `line`."""
    default = default_settings(*named(line))

    def train(
        algorithm: tyro.conf.Positional[Literal["ppo", "sac"]],
        /,
        env: Literal["ElbowArm-v0", "ElbowArmTable-v0", "ElbowArmRandom-v0"] = "ElbowArm-v0",
        elbows: int | None = None,
        seeds: int = 1,
        first_seed: int = 0,
        workers: int = 2,
        resume: bool = False,
        output: Path = Path("runs"),
        label: str = "",
        environment: str = "{}",
        initial_policy: Path | None = None,
        minutes: float | None = None,
        checkpoint_seconds: float = 60.0,
        settings: AlgorithmSettings = default,
    ) -> None:
        """Trains agents, several seeds side by side; Ctrl-C keeps the best policies so far.

        Each seed has a folder OUTPUT/ALGORITHM[_LABEL]_TASK_seedK with its best policy, evaluations.csv, a checkpoint
        and TensorBoard logs.

        Args:
            algorithm: the algorithm.
            env: the environment's id.
            elbows: elbows on the table; the id's own, or 2, when not given.
            seeds: how many are trained.
            first_seed: the first of them.
            workers: processes, one seed each.
            resume: go on from the last checkpoints; finished seeds are left alone.
            output: folder of the runs.
            label: goes into the names, for runs that are not the plain algorithm's, such as "cloned".
            environment: more arguments of the environment as a JSON object, such as '{"energy_weight": 0.002}'.
            initial_policy: a policy whose weights the actor starts from.
            minutes: ends each seed's training after so many.
            checkpoint_seconds: time between two checkpoints.
            settings: the algorithm's settings; the defaults are those for the algorithm, env and elbows given.
        """
        from agents.learning.evaluation import sentence
        from agents.learning.run_folder import Run
        from agents.learning.train import train_all

        chosen = task_settings(env, elbows, json.loads(environment))
        name = "_".join(part for part in (algorithm, label, task_name(env, elbows)) if part)
        print(f"{name}, seeds {first_seed} to {first_seed + seeds - 1}, into {output}: {settings}", flush=True)
        first = Run(
            algorithm=algorithm,
            env=env,
            environment=json.loads(json.dumps(chosen.arguments)),
            settings=settings,
            seed=first_seed,
            folder=output,
            minutes=minutes,
            checkpoint_seconds=checkpoint_seconds,
            initial_policy=initial_policy,
        )
        runs = [
            replace(first, seed=seed, folder=output / f"{name}_seed{seed}")
            for seed in range(first_seed, first_seed + seeds)
        ]
        for result in train_all(runs, workers, resume):
            state = "finished" if result["finished"] else "not finished"
            print(f"{result['name']}: {state} after {result['steps']:,d} steps, best: {sentence(result['best'])}")

    # The type decides which fields the command line has, and is known only now.
    train.__annotations__["settings"] = Annotated[type(default), tyro.conf.arg(name="")]
    return train


def named(line: Sequence[str]) -> tuple[str, str]:
    """The algorithm and the task that a command line names; what it leaves out, or gets wrong, counts as the default.

    Wrong values are left to the parser, which says what is allowed.
    """
    words = [word for part in line for word in part.split("=", 1)]
    algorithm = next((word for word in words if word in ALGORITHMS), "ppo")
    values: dict[str, Any] = dict(pairwise(words))
    env, elbows = values.get("--env", "ElbowArm-v0"), values.get("--elbows", "")
    try:
        return algorithm, task_name(env, int(elbows) if elbows.isdigit() else None)
    except ValueError:
        return algorithm, "elbows2"

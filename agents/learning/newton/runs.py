"""Runs of the imitation of Newton's steps: a folder for each seed, from whose checkpoint a stopped one goes on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from agents.files import write_whole
from agents.jobs.job import Tell
from agents.jobs.machines import Machines
from agents.learning.newton.settings import NewtonSettings
from agents.learning.newton.training import Training
from agents.learning.rounds import Judge, RoundsRun, train_by_rounds
from agents.learning.run import machine, versions
from agents.learning.run_folder import RunFolder
from agents.learning.threads import one_thread
from elbow_gym.baselines.policy import Policy
from elbow_gym.task.settings import Settings

CHECKPOINT = "newton.pt"
"""File that a stopped run goes on from, written after every evaluation; it holds tensors and numbers, no code."""


def newton_all(
    settings: Settings,
    env: str,
    initial: Policy,
    how: NewtonSettings,
    folders: Mapping[int, Path],
    command: str,
    resume: bool = False,
    machines: Machines | None = None,
) -> dict[int, dict[str, Any]]:
    """Trains several seeds side by side, in processes unless machines are given; the results by seed.

    Args:
        settings: settings of the environment, JSON types only.
        env: its Gymnasium id.
        initial: policy that drives in the first rounds.
        how: settings of the training.
        folders: folders of the runs by seed.
        command: command line for the cards of the policies.
        resume: whether runs go on from their last checkpoint; finished ones are left alone.
        machines: where they are trained.

    Raises:
        ValueError: a folder holds a run already and `resume` is not set or it had other settings; or the environment
            has what the teacher does not know, or the initial policy is not for it.
    """
    Training(settings, how, 0, initial)
    work = partial(_train, settings, env, initial, how, command)
    record = {"env": env, "environment": settings.arguments, "settings": asdict(how), "initial": initial.card.digest}
    runs = {
        seed: RoundsRun(
            folder=folder, record=json.loads(json.dumps({**record, "seed": seed})), work=work, rounds=how.rounds
        )
        for seed, folder in folders.items()
    }
    stopped = "stopped; --resume goes on from its last checkpoint, or starts it"
    return train_by_rounds(runs, settings, "newton", stopped, resume, machines)


def _train(
    settings: Settings, env: str, initial: Policy, how: NewtonSettings, command: str, run: RoundsRun, tell: Tell
) -> dict[str, Any]:
    """Trains with one seed, in a process of its own."""
    import torch

    files, seed, checkpoint = RunFolder(run.folder), run.record["seed"], run.folder / CHECKPOINT
    files.open(run.record, resume=True)
    with one_thread():
        training, found = Training(settings, how, seed, initial), checkpoint.is_file()
        if found:
            training.restore(torch.load(checkpoint, weights_only=True))
            tell(training.rounds)
        judge = Judge(files, settings, resume=found)
        card = {"command": command, "env": env, "versions": versions()}
        while training.rounds < how.rounds:
            figures = training.round()
            if training.rounds % how.evaluate_every == 0 or training.rounds == how.rounds:
                own = {**asdict(how), "seed": seed, "last_round": figures, "machine": machine()}
                judge(training.steps, training.policy({**card, "training": own}))
                write_whole(checkpoint, partial(torch.save, training.state()))
            tell(1)
    return judge.finish(seed)

"""Imitation of the LQR on the optimum by a network, on the states that the network itself visits (DAgger)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.lqr import TimeVaryingLQR
from agents.control.trajectory import Trajectory
from agents.jobs.job import Tell
from agents.jobs.machines import Machines
from agents.learning.clone_settings import CloneSettings
from agents.learning.rounds import Judge, RoundsRun, train_by_rounds
from agents.learning.run import machine, versions
from agents.learning.run_folder import RunFolder
from agents.learning.threads import one_thread
from elbow_gym.baselines.policy import Policy
from elbow_gym.baselines.policy_card import PolicyCard
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

LOWEST_RATE = 0.01
"""Share of its start that the learning rate ends at [-]."""


def clone(
    settings: Settings,
    trajectory: Trajectory,
    how: CloneSettings,
    seed: int,
    card: dict[str, Any],
    after_round: Callable[[int, Policy], Any],
) -> Policy:
    """Fits a network to the actions of the LQR around a trajectory, on the states that the network itself runs into.

    Args:
        settings: settings of the environment, JSON types only.
        trajectory: optimum that the teacher follows.
        how: settings of the imitation.
        seed: seed of the network, the start poses, the noise and the batches.
        card: further fields of the policy's card.
        after_round: called with the number of control periods so far, summed over all arms, and the policy.

    Returns:
        The policy after the last round.
    """
    import torch

    from agents.learning.fit import Fit

    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    env = ElbowArmVectorEnv(how.num_envs, **settings.arguments, autoreset_mode="Disabled")
    teacher = TimeVaryingLQR(env, trajectory)
    observation, _ = env.reset(seed=rng.integers(2**31, size=how.num_envs).tolist())
    sizes = (observation.shape[1], *how.hidden, env.action_space.shape[1])
    network = _network(sizes)
    fit = Fit(network)
    seen: list[NDArray[np.float32]] = []
    labels: list[NDArray[np.float32]] = []
    policy = _policy(network, sizes, settings, env, card)
    for k in range(how.rounds):
        if k > 0:
            observation, _ = env.reset(seed=rng.integers(2**31, size=how.num_envs).tolist())
        teacher.restart()
        taught = rng.random(how.num_envs) < 1.0 - k / (how.teaching * how.rounds)
        shaken = how.noise * (np.arange(how.num_envs) % 2)
        for _ in range(settings.horizon):
            label, _ = teacher.predict(observation)
            own, _ = policy.predict(observation)
            seen.append(observation)
            labels.append(label)
            action = np.where(taught[:, None], label, own) + shaken[:, None] * rng.standard_normal(label.shape)
            observation, *_ = env.step(np.clip(action, -1.0, 1.0).astype(np.float32))
        x, y = np.concatenate(seen), np.concatenate(labels)
        for j in range(how.gradient_steps):
            done = (k + j / how.gradient_steps) / how.rounds
            rate = how.learning_rate * max(LOWEST_RATE, 0.5 * (1.0 + np.cos(np.pi * done)))
            fit.step(rng.integers(len(x), size=how.batch_size), x, y, rate)
        policy = _policy(network, sizes, settings, env, card)
        after_round((k + 1) * settings.horizon * how.num_envs, policy)
    return policy


def _network(sizes: tuple[int, ...]) -> Any:
    import torch

    layers: list[Any] = []
    for size, after in pairwise(sizes):
        layers += [torch.nn.Linear(size, after), torch.nn.Tanh()]
    return torch.nn.Sequential(*layers[:-1])


def _policy(
    network: Any, sizes: tuple[int, ...], settings: Settings, env: ElbowArmVectorEnv, card: dict[str, Any]
) -> Policy:
    weights = {}
    for k, layer in enumerate(network[::2]):
        weights[f"weight_{k}"] = layer.weight.detach().numpy().copy()
        weights[f"bias_{k}"] = layer.bias.detach().numpy().copy()
    whole = PolicyCard(
        algorithm="clone",
        environment=json.loads(json.dumps(settings.arguments)),
        observation=env.observation_names,
        layers=sizes,
        activation="tanh",
        **card,
    )
    return Policy(whole, weights)


def clone_all(
    settings: Settings,
    trajectory: Path,
    how: CloneSettings,
    seeds: list[int],
    folders: list[Path],
    command: str,
    resume: bool = False,
    machines: Machines | None = None,
) -> dict[int, dict[str, Any]]:
    """Clones with several seeds side by side, in processes unless machines are given; the results by seed.

    Each folder gets the files of a `RunFolder` but checkpoints and logs. With `resume` the seeds that are finished are
    left alone; the others, a minute each, start anew.

    Raises:
        ValueError: there is no such trajectory, or a folder holds a run already and `resume` is not set or it had
            other settings.
    """
    from agents.learning.compiled import COMPILE_SECONDS
    from agents.learning.fit import compile_fit

    if not trajectory.is_file():
        raise ValueError(f"trajectory must be a file that `python -m benchmarks optimal` wrote, got no {trajectory}")
    work = partial(_clone_one, settings, trajectory.absolute(), how, command)
    runs = {
        seed: RoundsRun(folder=folder, record=_record(settings, trajectory, how, seed), work=work, rounds=how.rounds)
        for seed, folder in zip(seeds, folders, strict=True)
    }
    others = {compile_fit: COMPILE_SECONDS}
    return train_by_rounds(runs, settings, "clone", "stopped; --resume starts it anew", resume, machines, others)


def _record(settings: Settings, trajectory: Path, how: CloneSettings, seed: int) -> dict[str, Any]:
    """Everything that tells the run from others, JSON types only."""
    plain = {
        "environment": settings.arguments,
        "trajectory": hashlib.sha256(trajectory.read_bytes()).hexdigest(),
        "settings": asdict(how),
        "seed": seed,
    }
    return json.loads(json.dumps(plain))


def _clone_one(
    settings: Settings, trajectory: Path, how: CloneSettings, command: str, run: RoundsRun, tell: Tell
) -> dict[str, Any]:
    """Clones with one seed, in a process of its own."""
    files, seed = RunFolder(run.folder), run.record["seed"]
    files.open(run.record, resume=True)
    judge = Judge(files, settings)
    training = {**asdict(how), "seed": seed, "machine": machine()}
    card = {"command": command, "training": training, "versions": versions()}

    def after_round(steps: int, policy: Policy) -> None:
        judge(steps, policy)
        tell(1)

    with one_thread():
        clone(settings, Trajectory.load(trajectory), how, seed, card, after_round)
    return judge.finish(seed)

"""Players that a user brings: training runs, policies, Stable-Baselines3's and ONNX models, Python objects."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.controller import Controller
from agents.evaluation.onnx_model import OnnxModel, contract_of
from agents.evaluation.player import Player, player_of, policy_player
from agents.evaluation.sb3_model import check_trust, load_model
from agents.evaluation.statistics import statistics_file
from agents.tasks import BEST, RUNS, Elbows, task_settings
from elbow_gym.baselines.policy import pair, read_policy
from elbow_gym.parameters import as_elbows
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

KINDS = "the folder of a run, a policy's file, a Stable-Baselines3 .zip, an .onnx file or module:callable"
"""Kinds of players from outside the registry, for messages."""
ENVIRONMENT = "environment"
"""Attribute of a controller, or of what makes it, with arguments of the environment that it plays in."""


class Adapted:
    """Controller around any object with `predict(observation)`.

    Args:
        inner: object whose `predict` maps observations (B, size) to actions (B, n), alone or first in a tuple; it may
            take the argument `deterministic`.
    """

    def __init__(self, inner: Any) -> None:
        self._predict = inner.predict
        accepted = inspect.signature(inner.predict).parameters.values()
        keyword = any(one.name == "deterministic" or one.kind is one.VAR_KEYWORD for one in accepted)
        self._options = {"deterministic": True} if keyword else {}

    def predict(self, observation: NDArray[np.float32], *_args: Any, **_kwargs: Any) -> tuple[Any, None]:
        """Actions (B, n) for observations (B, size)."""
        answer = self._predict(observation, **self._options)
        return answer[0] if isinstance(answer, tuple) else answer, None


def own_player(
    name: str, elbows: Elbows | None, env: str, arguments: Mapping[str, Any], trust: bool = False
) -> Player | None:
    """The player that a path or an import path names, labelled by it; None where it names neither.

    Policies and ONNX files with a contract bring their environments. Others play in `env`.

    Args:
        name: one of `KINDS`; the folder may be named as in `RUNS`.
        elbows: elbows on the table; the environment's own number when None.
        env: id of the environment.
        arguments: further arguments of the environment, which take precedence.
        trust: whether a file that may run code when it is read may be read.

    Raises:
        ValueError: a file or an object is not what it should be, does not fit the environment, or is not trusted.
    """
    path = located(name)
    if path is None:
        return python_player(name, _imported(name), elbows, env, arguments) if ":" in name else None
    if path.suffix == ".zip":
        check_trust(path, trust)
        settings = task_settings(env, elbows, arguments)
        return player_of(name, settings, partial(load_model, path), identity=_digest(path, statistics_file(path)))
    if path.suffix == ".onnx":
        contract = contract_of(path)
        trained = task_settings(env, elbows, arguments) if contract is None else _settings(contract, elbows, arguments)
        return player_of(name, trained, partial(OnnxModel, path), identity=_digest(path))
    policy = read_policy(path)
    # A run is known by its folder, whose best policies all have one name.
    name = path.parent.name if path.name == BEST and path.parent.name else name
    return policy_player(name, policy, _settings(policy.card.environment, elbows, arguments))


def python_player(name: str, thing: Any, elbows: Elbows | None, env: str, arguments: Mapping[str, Any]) -> Player:
    """The player of a Python object: a controller, or a function or class that makes one for an environment.

    Its attribute `environment`, if it has one, holds arguments of the environment that it plays in, such as
    {"control_frequency": 500.0}. See `own_player` for the other arguments.

    Raises:
        ValueError: the object has no `predict` and cannot be called.
    """
    ready = hasattr(thing, "predict") and not isinstance(thing, type)
    if not ready and not callable(thing):
        raise ValueError(f"{name} must have predict(observation) or make what has it for an environment, got {thing!r}")

    def make(env: ElbowArmVectorEnv) -> Controller:
        controller = thing if ready else thing(env)
        if not hasattr(controller, "predict"):
            raise ValueError(f"{name} must make an object with predict(observation), got {controller!r}")
        return Adapted(controller)

    settings = task_settings(env, elbows, {**getattr(thing, ENVIRONMENT, {}), **arguments})
    # What a module imports may change unseen, so that its results are never taken over from an earlier run.
    return player_of(name, settings, make)


def labelled(word: str) -> tuple[str | None, str]:
    """Label and name in LABEL=NAME; no label where the whole word is a path or has no "="."""
    label, equals, name = word.partition("=")
    return (label, name) if label and equals and name and not Path(word).exists() else (None, word)


def relabelled(player: Player, label: str | None) -> Player:
    """The player under another name in tables and figures; as it is when None."""
    return player if label is None else replace(player, name=label, label=label)


def located(name: str) -> Path | None:
    """File of a model or a policy that a word names; None where there is none.

    Raises:
        ValueError: the word names a folder without a policy.
    """
    for path in (Path(name), RUNS / name):
        file = path / BEST if path.is_dir() else path
        if (file.suffix in (".zip", ".onnx") and file.is_file()) or pair(file)[0].is_file():
            return file
        if path.is_dir():
            raise ValueError(f"the folder of a run must hold {BEST}.json, got {path}")
    return None


def _settings(environment: Mapping[str, Any], elbows: Elbows | None, arguments: Mapping[str, Any]) -> Settings:
    """Settings of a training's environment with further arguments. Raises ValueError where the elbows are others."""
    trained = Settings(**environment)
    if elbows is not None and as_elbows(elbows, trained.parsed_arm.n_joints) != trained.elbow_joints:
        raise ValueError(f"elbows must be {trained.elbows} as in the policy's training, got {elbows}")
    return Settings(**{**trained.arguments, **arguments})


def _imported(name: str) -> Any:
    module, _, attributes = name.partition(":")
    try:
        thing = import_module(module.removesuffix(".py"))
        for attribute in attributes.split("."):
            thing = getattr(thing, attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise ValueError(f"{name} must be a module that can be imported and a name in it, got: {error}") from error
    return thing


def _digest(*paths: Path | None) -> str:
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths if path is not None)).hexdigest()

"""Attributes and methods of the arms of a batch, through the wrappers around it."""

from __future__ import annotations

from typing import Any, cast

from gymnasium.vector import VectorEnv, VectorWrapper

Batch = VectorEnv[Any, Any, Any]

OF_ONE_ARM = {"action_space": "single_action_space", "observation_space": "single_observation_space"}
"""Attributes of one arm, and the names that they have in a batch."""
BY_ARM = ("np_random", "np_random_seed", "render")
"""Attributes and methods that give one entry per arm."""
OF_ALL_ARMS = ("reset", "step", "get_state", "set_state")
"""Methods whose arguments or results hold all arms together."""


def layers(env: Batch) -> list[Batch]:
    """The wrappers around a batch, outermost first, and at last the batch."""
    found = [env]
    while isinstance(found[-1], VectorWrapper):
        found.append(cast("Batch", found[-1].env))
    return found


def holder(env: Batch, name: str) -> Batch:
    """The outermost of `layers` that has an attribute. AttributeError where none has it."""
    for one in layers(env):
        if hasattr(one, name):
            return one
    raise AttributeError(f"attribute of {env} must be one that it has, got {name!r}")


def ask(env: Batch, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
    """An attribute of every arm of a batch or wrapped batch, or the answer of its method, which is called once.

    Raises AttributeError where there is none, and ValueError for a method that concerns all arms together.
    """
    if name in OF_ALL_ARMS:
        raise ValueError(f"{name} must be called on the batch itself, since it concerns all arms together")
    found = getattr(holder(env, name), OF_ONE_ARM.get(name, name))
    answer: Any = found(*args, **kwargs) if callable(found) else found
    return tuple(answer) if name in BY_ARM and answer is not None else (answer,) * env.num_envs


def assign(env: Batch, name: str, values: Any) -> None:
    """Sets an attribute of all arms of a batch or wrapped batch, to a value or to equal ones in a list or tuple.

    Raises AttributeError where there is no such attribute or it cannot be set, and ValueError for values that differ
    between arms.
    """
    if isinstance(values, list | tuple):
        given = cast("list[Any]", values)
        if len(given) != env.num_envs or any(value != given[0] for value in given):
            raise ValueError(f"{name} must be the same for all {env.num_envs} arms of a batch, got {given!r}")
        values = given[0]
    setattr(holder(env, name), name, values)

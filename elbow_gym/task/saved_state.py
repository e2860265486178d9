"""Saved states of arms: rows of some of them, and checks of what only an environment has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elbow_gym.checks import LARGEST_INTEGER, as_dict, require_entries, saved_rows

ENTRIES = ("episodes", "generators", "over", "started")
"""Entries of an environment's saved state."""


class Marks(NamedTuple):
    """What an environment keeps beside its episodes: states of generators, and which arms are over and started."""

    generators: list[Any]
    over: NDArray[np.bool_]
    started: NDArray[np.bool_]


def rows_of(state: Any, chosen: NDArray[np.int64]) -> Any:
    """A copy of the chosen arms' rows of all arrays and lists in a dict."""
    if isinstance(state, dict):
        return {name: rows_of(part, chosen) for name, part in cast("dict[str, Any]", state).items()}
    if isinstance(state, list):
        return [cast("list[Any]", state)[i] for i in chosen]
    return state[chosen]


def check_basis(own: Mapping[str, Any], given: object) -> None:
    """ValueError naming the first setting that a saved state was not made with."""
    basis = as_dict("state['settings']", given)
    require_entries(basis, own, "state['settings']")
    for name, value in own.items():
        theirs: Any = basis[name]
        if type(theirs) is not type(value) or theirs != value:
            raise ValueError(f"state must be of an environment with the same {name}, {value!r}, got {theirs!r}")


def checked_rows(own: Mapping[str, NDArray[Any]], given: Mapping[str, Any], count: int) -> dict[str, NDArray[Any]]:
    """Rows of `count` arms of a saved state for each of one's own arrays, (B, ...).

    Raises ValueError naming one that is missing, of another size or not finite, or `steps` that no episode has.
    """
    require_entries(given, own, "state['episodes']")
    saved = {name: saved_rows(f"state[{name!r}]", given[name], array, count) for name, array in own.items()}
    steps = saved["steps"]
    if steps.min() < 0 or steps.max() > LARGEST_INTEGER:
        raise ValueError(f"state['steps'] must be from 0 to {LARGEST_INTEGER}, got {steps.min()} to {steps.max()}")
    return saved


def as_arms(arms: ArrayLike, num_envs: int) -> NDArray[np.int64]:
    """Numbers of arms from numbers, each once, or from a mask (B,). Raises ValueError on anything else."""
    given: NDArray[Any] = np.asarray(arms)
    if given.dtype == np.bool_ and given.shape == (num_envs,) and given.any():
        return np.flatnonzero(given)
    whole = given.dtype.kind in "iu" and given.ndim == 1 and given.size > 0
    if not whole or given.min() < 0 or given.max() >= num_envs or len(np.unique(given)) < given.size:
        raise ValueError(f"arms must be a mask, or numbers from 0 to {num_envs - 1}, each once, got {arms!r}")
    return given.astype(np.int64)


def number_of_arms(state: object) -> int:
    """Number of arms in an environment's saved state. Raises ValueError where it is none."""
    given = as_dict("state", state)
    require_entries(given, ENTRIES, "state")
    generators = given["generators"]
    if not isinstance(generators, list) or not generators:
        raise ValueError(f"state['generators'] must be a list with an entry for each arm, got {generators!r}")
    return len(cast("list[Any]", generators))


def checked_marks(state: Mapping[str, Any], generators: Sequence[np.random.Generator]) -> Marks:
    """What a saved state has beside its episodes. Raises ValueError where one of these generators cannot take it."""
    count, truth = len(state["generators"]), np.zeros(1, dtype=np.bool_)
    trial = type(generators[0].bit_generator)(0)
    for saved in state["generators"]:
        try:
            trial.state = saved
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            raise ValueError(
                f"state['generators'] must have states of {type(trial).__name__}, got {saved!r}"
            ) from error
    over, started = (saved_rows(f"state[{name!r}]", state[name], truth, count) for name in ("over", "started"))
    return Marks(state["generators"], over, started)

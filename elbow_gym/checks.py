"""Checks of arguments: a value in its plain type, or a ValueError that names the argument, the rule and the value."""

from __future__ import annotations

import math
import numbers
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def finite(name: str, value: object) -> float:
    """The value as a float; ValueError naming `name` unless it is a finite number."""
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise ValueError(f"{name} must be a number, got {value!r}")
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{name} must be finite, got {value!r}")
    return number


def positive(name: str, value: object) -> float:
    """The value as a float; ValueError naming `name` unless it is finite and above zero."""
    number = finite(name, value)
    if number <= 0.0:
        raise ValueError(f"{name} must be positive, got {value!r}")
    return number


def non_negative(name: str, value: object) -> float:
    """The value as a float; ValueError naming `name` unless it is finite and at least zero."""
    number = finite(name, value)
    if number < 0.0:
        raise ValueError(f"{name} must not be negative, got {value!r}")
    return number


def friction_coefficient(name: str, value: object) -> float:
    """The value as a float; ValueError naming `name` unless it is from zero to one.

    Above one, a contact jams or sticks at once in common poses, which no step in use resolves.
    """
    number = non_negative(name, value)
    if number > 1.0:
        raise ValueError(f"{name} must be at most 1, above which contacts jam in common poses, got {value!r}")
    return number


def positive_integer(name: str, value: object) -> int:
    """The value as an int; ValueError naming `name` unless it is a whole number of at least one."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < 1:
        raise ValueError(f"{name} must be a positive integer, got {value!r}")
    return int(value)


def check_entries(plain: Mapping[str, Any], allowed: set[str], owner: str) -> None:
    """ValueError naming `owner` and the first entry of `plain` that is not in `allowed`."""
    unknown = sorted(set(plain) - allowed)
    if unknown:
        raise ValueError(f"{owner} must have only the entries {sorted(allowed)}, got {unknown[0]!r}")


def require_entries(plain: Mapping[str, Any], required: Iterable[str], owner: str) -> None:
    """ValueError naming `owner` and the first entry of `required` that is not in `plain`."""
    for name in required:
        if name not in plain:
            raise ValueError(f"{owner} must have the entry {name!r}, got {sorted(plain)}")


def as_numbers(name: str, value: ArrayLike, *shapes: tuple[int, ...]) -> NDArray[np.float64]:
    """The value as a contiguous float64 array; ValueError naming `name` unless it is numbers of one of the shapes."""
    try:
        array = np.asarray(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers of shape {_listed(shapes)}, got {value!r}") from error
    if array.shape not in shapes:
        raise ValueError(f"{name} must have shape {_listed(shapes)}, got {array.shape}")
    return array


def as_batch(name: str, value: ArrayLike, shape: tuple[int, int]) -> NDArray[np.float64]:
    """A quantity as (B, n) float64, from (B, n) or one row for all. ValueError naming `name` unless finite numbers."""
    array = as_numbers(name, value, shape, shape[1:])
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {array[~np.isfinite(array)][0]}")
    return np.broadcast_to(array, shape)


def _listed(shapes: Iterable[tuple[int, ...]]) -> str:
    return " or ".join(map(str, shapes))


def check_restorable(own: Mapping[str, NDArray[Any]], state: Mapping[str, Any]) -> None:
    """ValueError naming the first array of `own` that `state` has not, or has in another shape."""
    for name, array in own.items():
        if name not in state or np.shape(state[name]) != array.shape:
            got = np.shape(state[name]) if name in state else "nothing"
            raise ValueError(f"state[{name!r}] must have shape {array.shape}, got {got}")


def restore(own: Mapping[str, NDArray[Any]], state: Mapping[str, Any]) -> None:
    """Copies a saved state's arrays into `own`. Raises as `check_restorable`, with nothing changed."""
    check_restorable(own, state)
    for name, array in own.items():
        array[...] = state[name]

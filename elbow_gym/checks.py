"""Checks of arguments: a value in its plain type, or a ValueError that names the argument, the rule and the value."""

from __future__ import annotations

import math
import numbers
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

SAVED_KINDS = {"f": "fiu", "i": "iu", "b": "b"}
"""Kinds of numbers that a saved array may have, by the kind of the array that takes them."""
LARGEST_INTEGER = 2**31
"""Counts of arms, threads and control periods are at most this."""
LONGEST_SHOWN = 10**20


def finite(name: str, value: object) -> float:
    """The value as a float; ValueError naming `name` unless it is a finite number."""
    # A float first: to be asked of an abstract class takes ten times as long, and an arm has hundreds of numbers.
    if not isinstance(value, float) and (isinstance(value, bool) or not isinstance(value, numbers.Real)):
        raise ValueError(f"{name} must be a number, got {value!r}")
    if not is_finite(value):
        raise ValueError(f"{name} must be finite, got {shown(value)}")
    return float(value)


def is_finite(value: float | numbers.Real) -> bool:
    """Whether float64 can represent a number; integers beyond 1e308 it cannot."""
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def shown(value: object) -> str:
    """A value's text for a message; that of a long integer is shortened, where Python may refuse to write it."""
    if isinstance(value, int) and abs(value) > LONGEST_SHOWN:
        return "an integer of more than twenty digits"
    return repr(value)


def one_of(name: str, value: object, allowed: Sequence[str]) -> str:
    """The value; ValueError naming `name` unless it is one of the strings."""
    if not isinstance(value, str) or value not in allowed:
        raise ValueError(f"{name} must be one of {allowed}, got {value!r}")
    return value


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
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or not 1 <= int(value) <= LARGEST_INTEGER:
        raise ValueError(f"{name} must be a positive integer, got {shown(value)}")
    return int(value)


def check_entries(plain: Mapping[str, Any], allowed: set[str], owner: str) -> None:
    """ValueError naming `owner` and the first entry of `plain` that is not in `allowed`."""
    unknown = sorted(set(plain) - allowed, key=str)
    if unknown:
        raise ValueError(f"{owner} must have only the entries {sorted(allowed)}, got {unknown[0]!r}")


def require_entries(plain: Mapping[str, Any], required: Iterable[str], owner: str) -> None:
    """ValueError naming `owner` and the first entry of `required` that is not in `plain`."""
    for name in required:
        if name not in plain:
            raise ValueError(f"{owner} must have the entry {name!r}, got {sorted(map(str, plain))}")


def real(value: Any) -> Any:
    """The value. Raises TypeError for complex arrays, whose imaginary part NumPy would drop with a warning."""
    kind: Any = getattr(value, "dtype", None)
    if kind is not None and kind.kind == "c":
        raise TypeError("complex")
    return value


def as_numbers(name: str, value: ArrayLike, *shapes: tuple[int, ...]) -> NDArray[np.float64]:
    """The value as a contiguous float64 array; ValueError naming `name` unless it is numbers of one of the shapes."""
    try:
        # A copy is aligned and can be written: Numba would compile the kernel again for arrays that are not.
        array = np.array(real(value), dtype=np.float64, order="C")
    except (OverflowError, TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers of shape {_listed(shapes)}, got {shown(value)}") from error
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


def as_dict(name: str, value: object) -> Mapping[str, Any]:
    """The value; ValueError naming `name` unless it is a dict or another mapping."""
    if not isinstance(value, Mapping):
        raise ValueError(f"{name} must be a dict, got {value!r}")
    return cast("Mapping[str, Any]", value)


def saved_rows(name: str, value: ArrayLike, like: NDArray[Any], count: int) -> NDArray[Any]:
    """A saved state's rows of `count` arms, as an array of the type and the rows' shape of `like`, (B, ...).

    ValueError naming `name` unless they are finite numbers of that shape, whole ones or truths where `like` has such.
    """
    shape, kind = (count, *like.shape[1:]), like.dtype.kind
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name} must have shape {shape}, got {value!r}") from error
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, got {array.shape}")
    if array.dtype.kind not in SAVED_KINDS[kind]:
        raise ValueError(f"{name} must have entries as {like.dtype}, got {array.dtype}")
    if kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {array[~np.isfinite(array)][0]}")
    return array.astype(like.dtype)

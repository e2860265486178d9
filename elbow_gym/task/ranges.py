"""Quantities that are a number, or a range from which one is drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

Range: TypeAlias = float | tuple[float, float]


def is_pair(value: object) -> bool:
    """Whether a value has the form of a range: two entries."""
    if isinstance(value, np.ndarray):
        return cast("NDArray[Any]", value).shape == (2,)
    return isinstance(value, list | tuple) and len(cast("Sequence[object]", value)) == 2


def as_range(name: str, value: Any, check: Callable[[str, object], float]) -> Range:
    """A number, or (low, high), each end as `check(name, end)` returns it. Raises ValueError naming `name`."""
    if not is_pair(value):
        return check(name, value)
    low, high = (check(name, end) for end in value)
    if low > high:
        raise ValueError(f"{name} must be a number or [low, high] with low <= high, got {value!r}")
    return low, high


def ends(value: Range) -> tuple[float, ...]:
    """Low and high of a range, or the number alone."""
    return value if isinstance(value, tuple) else (value,)


def draw_number(value: Range, generator: np.random.Generator) -> float:
    """The number, which draws nothing, or one `uniform(low, high)` of the range."""
    return generator.uniform(*value) if isinstance(value, tuple) else value

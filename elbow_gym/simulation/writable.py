"""Arrays of objects that arrive from another process: read-only ones are replaced by copies."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray


def take_over(*owners: object) -> None:
    """Replaces arrays that cannot be written by copies, in the attributes of some objects and in containers there.

    Buffers outside a pickle (protocol 5), memory maps and object stores give such arrays. An array that several objects
    share stays shared.
    """
    copies: dict[int, tuple[NDArray[Any], NDArray[Any]]] = {}
    for owner in owners:
        for name, value in list(vars(owner).items()):
            owner.__dict__[name] = _writable(value, copies)


def _writable(value: Any, copies: dict[int, tuple[NDArray[Any], NDArray[Any]]]) -> Any:
    if isinstance(value, np.ndarray):
        array = cast("NDArray[Any]", value)
        if array.flags.writeable:
            return array
        # The array itself is kept beside its copy, so that no other one takes its identity meanwhile.
        return copies.setdefault(id(array), (array, array.copy()))[1]
    if type(value) is dict:
        return {name: _writable(part, copies) for name, part in cast("dict[Any, Any]", value).items()}
    if type(value) is list or type(value) is tuple:
        parts = [_writable(part, copies) for part in cast("list[Any]", value)]
        return parts if isinstance(value, list) else tuple(parts)
    return value

"""Infos of a batch of arms, with one row per arm, some in dicts inside: rows of one arm, masks, replaced rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from elbow_gym.parameters import Array

Flags = NDArray[np.bool_]


def of_arm(info: Mapping[str, Any], i: int = 0) -> dict[str, Any]:
    """Info of arm i: numbers, truths, arrays, and dicts of them."""
    one = {
        key: of_arm(cast("dict[str, Any]", rows), i) if type(rows) is dict else rows[i] for key, rows in info.items()
    }
    if "overheated" in one:
        one["overheated"] = bool(one["overheated"])
    return one


def masked(info: Mapping[str, Any], mask: Flags) -> dict[str, Any]:
    """Gymnasium's vector info: each key beside its `_key` mask of the arms that have it, and so in dicts inside."""
    full: dict[str, Any] = {
        key: masked(cast("dict[str, Any]", rows), mask) if isinstance(rows, dict) else rows
        for key, rows in info.items()
    }
    full.update({f"_{key}": mask.copy() for key in info})
    return full


def unmasked(info: Mapping[str, Any]) -> dict[str, Any]:
    """The info without its `_key` masks."""
    return {
        key: unmasked(cast("dict[str, Any]", rows)) if isinstance(rows, dict) else rows
        for key, rows in info.items()
        if not key.startswith("_")
    }


def only(info: Mapping[str, Any], mask: Flags) -> dict[str, Any]:
    """A copy of the info with zeros for the arms outside the mask (B,)."""
    return {
        key: only(cast("dict[str, Any]", rows), mask)
        if isinstance(rows, dict)
        else np.where(_spread(mask, rows), rows, np.zeros_like(rows))
        for key, rows in info.items()
    }


def restarted(info: Mapping[str, Any], new: Mapping[str, Any], mask: Flags) -> dict[str, Any]:
    """The info with the rows of a reset's info for the arms in the mask (B,), in place, and with its keys."""
    for key, rows in new.items():
        if isinstance(rows, dict):
            restarted(info[key], cast("dict[str, Any]", rows), mask)
        else:
            info[key][mask] = rows[mask]
    return {key: info[key] for key in new}


def _spread(mask: Flags, rows: Array) -> Flags:
    """The mask (B,) with trailing axes, so that it broadcasts against rows (B, ...)."""
    return mask.reshape(-1, *([1] * (rows.ndim - 1)))

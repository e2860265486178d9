"""The kernel's files in Numba's cache: where they are, and which of them no present source can use."""

from __future__ import annotations

import re
from pathlib import Path

from elbow_gym.kernel.path import path
from elbow_gym.kernel.template import sources

NAME = re.compile(r"[a-z_0-9]+\.\w+_([0-9a-f]{10})-\d+\.py\d+\.(?:nbi|lock|\d+\.nbc)")
"""Name of an entry's file: module, name with the digest of the sources, line, Python and kind."""


def folder() -> Path | None:
    """The cache's folder; None where none can be written."""
    place = path.stats.cache_path if hasattr(path, "stats") else None
    return None if place is None else Path(place)


def remove_stale(place: Path) -> int:
    """Removes the kernel's files of other sources from a cache folder; returns how many there were."""
    stale = [
        file for file in place.iterdir() if (found := NAME.fullmatch(file.name)) is not None and found[1] != sources()
    ]
    for file in stale:
        file.unlink(missing_ok=True)
    return len(stale)

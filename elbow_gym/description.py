"""Description of an installation in text: ids, arguments, observations, and the compiled kernel's cache."""

from __future__ import annotations

import shutil
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import fields
from inspect import getdoc

from elbow_gym.env import ElbowArmEnv
from elbow_gym.kernel.cache import folder
from elbow_gym.task.settings import Settings

INDENT = 2
"""Indent of the lines of a part [characters]."""
LEAST_WIDTH = 24
"""Width of a table's last column at least [characters]."""


def table(rows: Iterable[Sequence[object]]) -> list[str]:
    """Lines of a table whose columns are as wide as their widest entry; the last is broken at the terminal's width."""
    texts = [[str(entry) for entry in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*texts, strict=True)]
    left = sum(widths[:-1]) + 2 * (len(widths) - 1)
    wrapper = textwrap.TextWrapper(
        max(left + LEAST_WIDTH, shutil.get_terminal_size().columns - INDENT),
        subsequent_indent=" " * left,
        break_long_words=False,
        break_on_hyphens=False,
    )
    lines = ("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)) for row in texts)
    return [part for line in lines for part in wrapper.wrap(line.rstrip())]


def argument_rows() -> list[tuple[str, str, str]]:
    """Name, default and meaning of each argument of an environment."""
    lines = (getdoc(ElbowArmEnv) or "").splitlines()
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    meanings = {cell[0]: cell[2] for cell in cells if len(cell) == 3}
    return [(field.name, repr(field.default), meanings[field.name]) for field in fields(Settings)]


def describe(ids: Sequence[str]) -> str:
    """Ids, the arguments with their defaults, the default observation's entries, and the cache's folder.

    Args:
        ids: the registered ids.
    """
    env = ElbowArmEnv()
    layout = env.episodes.layout
    observations = [
        (
            f.name,
            f"{layout.slices[f.name].start}..{layout.slices[f.name].stop - 1}",
            f.unit,
            f.scale,
            f.limit,
            f.meaning,
        )
        for f in layout.features
    ]
    parts = {
        "Ids": [*ids],
        "Arguments": table([("argument", "default", "meaning"), *argument_rows()]),
        f"Observation of ElbowArm-v0, {layout.size} entries": table(
            [("name", "entries", "unit", "scale", "limit", "meaning"), *observations]
        ),
        "Cache of the compiled kernel": [str(folder() or "nowhere: no folder can be written")],
    }
    return "\n\n".join("\n".join([title, *(" " * INDENT + line for line in lines)]) for title, lines in parts.items())

"""Reproduction of the paper's cases on an arm, on its own table or on one that gives way."""

from __future__ import annotations

import sys
from pathlib import Path

from agents.paper.subject import Subject


def reproduce(subject: Subject, output: Path, publish: bool, table: bool) -> None:
    """Plays the cases of `subject` and writes figures, series and verdict to `output`.

    Args:
        subject: arm and elbows.
        output: folder.
        publish: whether to refresh the committed pictures and numbers too.
        table: whether to play on a compliant table, which cannot pull.
    """
    if subject.path is not None:
        print(subject.described(), file=sys.stderr)
    if table:
        from agents.paper.table_claims import reproduce_on_table as play
    else:
        from agents.paper.cases import reproduce as play
    play(output, publish=publish, subject=subject)

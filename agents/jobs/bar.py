"""Progress on the terminal: one bar for all jobs together, and lines about them."""

from __future__ import annotations

import sys
from typing import Any

from agents.cli import forget_lost_terminal


class Bar:
    """Bar of work with the time left, on stderr where that is a terminal; called as a job's `Tell`.

    Args:
        total: units of work.
        unit: name of one.
    """

    def __init__(self, total: int, unit: str) -> None:
        from tqdm import tqdm

        self._bar = tqdm(total=total, unit=unit, unit_scale=True, disable=None)

    def __call__(self, units: int, line: str = "") -> None:
        """Takes the units that were done since the last call, and perhaps a line for the reader."""
        if line:
            say(line)
        try:
            self._bar.update(units)
        except OSError:
            # Whoever closes a terminal may want the work to be saved, if not to go on.
            forget_lost_terminal()

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: Any) -> None:
        self._bar.close()


def say(line: str) -> None:
    """Prints a line above the bars that there are."""
    from tqdm import tqdm

    try:
        tqdm.write(line)
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError:
        forget_lost_terminal()

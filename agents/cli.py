"""How a command line of this project runs: errors of the user's making end with one line."""

from __future__ import annotations

import sys
from typing import Any

from gymnasium.error import DependencyNotInstalled


def run(app: Any, prog: str, description: str | None) -> None:
    """Runs a tyro app; a wrong argument or a missing extra ends with one line that says what is wrong."""
    try:
        app.cli(prog=prog, description=description)
    except (ValueError, DependencyNotInstalled) as error:
        sys.exit(f"error: {error}")

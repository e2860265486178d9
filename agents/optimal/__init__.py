"""Bound on the return, by optimal control."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from agents.optimal.batch import bounds
    from agents.optimal.search import bound

__all__ = ["bound", "bounds"]


def __getattr__(name: str) -> Any:
    # Imported when first asked for: the command line needs the package's name alone.
    if name == "bound":
        from agents.optimal.search import bound

        return bound
    if name == "bounds":
        from agents.optimal.batch import bounds

        return bounds
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

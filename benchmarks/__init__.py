"""Benchmarks of energy, learning, the optimum and speed: `python -m benchmarks`."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchmarks.energy.own import score

__all__ = ["score"]

_HOME = Path(__file__).resolve().parents[1]
_found = find_spec("agents")
_place = Path(_found.origin).resolve().parents[1] if _found is not None and _found.origin else None
# Other distributions own that name, too, and outside the checkout Python finds theirs first.
if _place != _HOME:
    raise ImportError(f"agents must be the package in {_HOME}, got that in {_place}; run the command in {_HOME}")


def __getattr__(name: str) -> Any:
    # Imported when first asked for, so that help loads no compiler.
    if name == "score":
        from benchmarks.energy.own import score

        return score
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

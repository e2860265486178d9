"""Controllers, training, evaluation and the reproduction of the paper: `python -m agents`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from agents.shipped.seeds import load_policy

__all__ = ["load_policy"]


def __getattr__(name: str) -> Any:
    # Imported when first asked for, so that `import agents` loads no compiler.
    if name == "load_policy":
        from agents.shipped.seeds import load_policy

        return load_policy
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

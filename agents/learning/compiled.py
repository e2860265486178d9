"""Compilation of loops over arrays in single precision, with the compiled forms on disk."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba import njit

from elbow_gym.kernel.disk_cache import stored
from elbow_gym.kernel.template import renamed

COMPILE_SECONDS = 4
"""Approximate time that the loops of one learner take to compile [s]."""
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "fastmath": {"contract"}}


def compiled(function: Callable[..., Any]) -> Any:
    """Compiled form of a function of this folder or the caller's that compiled ones call."""
    return njit(**_OPTIONS, no_cpython_wrapper=True)(function)


def entry(function: Any) -> Any:
    """Compiled form of a function that Python calls, stored on disk.

    Its name has a digest of the files in this folder and its own: Numba would take a form whose callee in another file
    has changed for current.
    """
    folders = Path(__file__).parent, Path(function.__code__.co_filename).parent
    texts = (path.read_bytes() for folder in dict.fromkeys(folders) for path in sorted(folder.glob("*.py")))
    digest = hashlib.sha256(b"".join(texts)).hexdigest()[:10]
    named = renamed(function, function.__globals__, f"{function.__name__}_{digest}")
    return stored(njit(**_OPTIONS)(named))

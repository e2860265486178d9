"""Compilations: announced where they take long, and spared of what slows the compiler down."""

# pyright: basic

from __future__ import annotations

import gc
import sys
from collections.abc import Generator
from contextlib import contextmanager
from threading import Timer
from typing import Any

from numba.core import types

PATIENCE = 2.0
"""Compilations that take longer [s] are announced."""

_answers: dict[Any, Any] = {}


@contextmanager
def compiling(context: Any) -> Generator[None]:
    """Around a compilation with a typing context."""
    with announced(), uncollected(), remembered(context):
        yield


@contextmanager
def announced() -> Generator[None]:
    """Says so when what is called inside takes a while."""
    message = "elbow_gym: compiling for this machine, once; later starts take it from the cache"
    notice = Timer(PATIENCE, print, (message,), {"file": sys.stderr, "flush": True})
    notice.daemon = True
    notice.start()
    try:
        yield
    finally:
        notice.cancel()
        notice.join()


@contextmanager
def uncollected() -> Generator[None]:
    """Keeps Python's collector of cycles from looking, over and over, through what the compiler builds up."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


@contextmanager
def remembered(context: Any) -> Generator[None]:
    """Has a typing context answer without a search what it has been asked before.

    For each of thousands of sums and products it would go through all overloads of + and * again.
    """
    search = context.resolve_function_type

    def resolve(function: Any, args: Any, kws: Any) -> Any:
        if kws or isinstance(function, types.Dispatcher):
            return search(function, args, kws)
        try:
            found = _answers.get((function, args))
        except TypeError:  # A constant slice has no hash before Python 3.12.
            return search(function, args, kws)
        if found is None:
            found = _answers[function, args] = search(function, args, kws)
        return found

    context.resolve_function_type = resolve
    try:
        yield
    finally:
        context.resolve_function_type = search

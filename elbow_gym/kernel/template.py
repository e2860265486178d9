"""Templates: functions that every kernel gets its own compiled copy of."""

import hashlib
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

from numba import njit

from elbow_gym.kernel.disk_cache import stored

Entry = Callable[..., Any]
"""A compiled function."""


class Template(NamedTuple):
    """A function and how it is compiled."""

    function: Any
    inlined: bool
    """Whether the compiler's back end writes it into every caller."""
    flat: bool
    """Whether it is written into its caller before that is compiled: nested ones would be optimised once a level."""
    pure: bool
    """Whether it knows neither lanes nor switches, so that all kernels share one compiled copy."""
    entry: bool
    """Whether Python calls it; it is then cached on disk with all that it calls."""


TEMPLATES: dict[str, Template] = {}
"""Every template by its name."""


def template(
    function: Any = None, *, inlined: bool = False, flat: bool = False, pure: bool = False, entry: bool = False
) -> Any:
    """Decorator that marks a function as a template, and leaves the function itself as it is.

    Args:
        function: the function; None where the decorator has arguments.
        inlined: compile it into every caller, for a body of a loop over lanes.
        flat: write it into its caller, for a sequence of passes that one place calls.
        pure: all kernels share it, for a function of numbers alone.
        entry: Python calls it; it is cached on disk.
    """
    if function is None:
        return partial(template, inlined=inlined, flat=flat, pure=pure, entry=entry)
    TEMPLATES[function.__name__] = Template(function, inlined, flat, pure, entry)
    return function


def compiled(function: Any, *, cached: bool = False, inlined: bool = False, flat: bool = False) -> Any:
    """The compiled function, with a cache on disk if it is `cached` and a folder can be written.

    Python can call it only if it is `cached`: the wrappers that calls from Python go through are half of what there is
    to compile for a short function.
    """
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "forceinline": inlined, "no_cfunc_wrapper": True}
    if flat:
        options["inline"] = "always"
    if not cached:
        options["no_cpython_wrapper"] = True
        return njit(**options)(function)
    return stored(njit(**options)(function))


@cache
def common_copy(function: Any, compile_with: Entry) -> Entry:
    """The one compiled copy of a pure function."""
    return compile_with(function, inlined=True)


def compiled_entry(function: Any) -> Any:
    """Compiled copy of a function that Python calls, cached on disk under a name with the digest of the sources."""
    names: dict[str, Any] = function.__globals__
    return compiled(renamed(function, names, f"{function.__name__}_{sources()}"), cached=True)


@cache
def sources() -> str:
    """Digest of all files of the kernel.

    It is part of the name of everything cached on disk: Numba's cache compares the file of an entry alone, and would
    take an entry whose callee in another file has changed for current.
    """
    texts = (path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
    return hashlib.sha256(b"".join(texts)).hexdigest()[:10]


def instances(known: dict[str, Any], suffix: str, compile_with: Entry = compiled) -> dict[str, Entry]:
    """The entries by name: all templates copied, with other values for the names that they were written with.

    Closures would do the same, but Numba's disk cache never recognises a closure over compiled functions.

    Args:
        known: values by name, in place of the globals of the templates' files.
        suffix: added to the names of the copies.
        compile_with: `compiled`, or a function of the same form that leaves them interpreted.
    """
    space: dict[str, Any] = {}
    for each in TEMPLATES.values():
        space.update(each.function.__globals__)
    space.update(known)
    for name, each in TEMPLATES.items():
        if each.pure:
            space[name] = common_copy(each.function, compile_with)
            continue
        copy = renamed(each.function, space, f"{name}_{suffix}")
        space[name] = compile_with(copy, cached=each.entry, inlined=each.inlined, flat=each.flat)
    return {name: space[name] for name, each in TEMPLATES.items() if each.entry}


def renamed(function: FunctionType, names: dict[str, Any], name: str) -> FunctionType:
    """A copy of a function with other globals and another name."""
    copy = FunctionType(function.__code__, names, name)
    copy.__qualname__ = name
    copy.__doc__ = function.__doc__
    return copy

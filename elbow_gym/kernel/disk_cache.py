"""Compiled entries on disk: read whole or compiled again, and compiled by one process while others wait."""

# pyright: basic

from __future__ import annotations

import hashlib
import pickle
import sys
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import Any

from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.compiler_lock import global_compiler_lock

from elbow_gym.kernel.compilation import compiling

try:
    import fcntl
except ImportError:  # Windows has none: processes that start together compile side by side.
    fcntl = None

CHECKSUM_SIZE = hashlib.sha256().digest_size


class DamagedError(Exception):
    """A file of the cache is not as it was written."""


class CheckedFiles(IndexDataCacheFile):
    """Numba's index and data files with a checksum behind the pickles, which these do not read."""

    def _dump(self, obj: Any) -> bytes:
        data = super()._dump(obj)
        return data + hashlib.sha256(data).digest()

    def _load_index(self) -> dict[Any, str]:
        index = Path(self._index_path)
        with suppress(FileNotFoundError), index.open("rb") as file:
            version = pickle.load(file)
            if version == self._version:
                check_whole(index, file.read())
        return super()._load_index()

    def _load_data(self, name: str) -> Any:
        path = Path(self._data_path(name))
        check_whole(path, path.read_bytes())
        return super()._load_data(name)


def check_whole(path: Path, data: bytes) -> None:
    """Raises DamagedError unless the data end with the checksum of what is before it."""
    if hashlib.sha256(data[:-CHECKSUM_SIZE]).digest() != data[-CHECKSUM_SIZE:]:
        raise DamagedError(f"{path} is damaged")


class EntryCache(FunctionCache):
    """Numba's cache of a function, which damaged files and a disk that takes none leave usable."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        stamp, base = self._impl.locator.get_source_stamp(), self._impl.filename_base
        self._cache_file = CheckedFiles(cache_path=self._cache_path, filename_base=base, source_stamp=stamp)

    @property
    def path(self) -> Path:
        """Index of the function's compiled forms."""
        return Path(self._cache_file._index_path)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """A compiled form from the disk; None where there is none. DamagedError ones are removed, with a notice."""
        try:
            return super().load_overload(sig, target_context)
        # A pickle that has been cut or altered raises anything.
        except Exception as error:
            say(f"a file of its cache is damaged and is made anew ({self.path}: {error or type(error).__name__})")
            with suppress(OSError):
                self.path.unlink(missing_ok=True)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Stores a compiled form; where the disk takes none, a notice says so, and the next start compiles again."""
        try:
            super().save_overload(sig, data)
        except (OSError, EOFError, pickle.PickleError, DamagedError) as error:
            say(f"what it compiled could not be stored, so that the next start compiles again ({error})")


def say(text: str) -> None:
    """A notice on standard error."""
    print(f"elbow_gym: {text}", file=sys.stderr, flush=True)


@contextmanager
def held(path: Path) -> Generator[None]:
    """Holds a lock file against other processes, as far as the system has such locks; the end of a process frees it."""
    try:
        file = path.open("ab")
    except OSError:
        yield
        return
    with file:
        if fcntl is not None:
            with suppress(OSError):
                fcntl.flock(file, fcntl.LOCK_EX)
        yield


def stored(dispatcher: Any) -> Any:
    """The dispatcher of a compiled function, with its compiled forms on disk, where a folder can be written.

    Of processes that need a form at the same time, one compiles it and the others wait for it.
    """
    if not hasattr(dispatcher, "py_func"):
        return dispatcher
    others: Callable[[], AbstractContextManager[None]] = nullcontext
    with suppress(RuntimeError):
        dispatcher._cache = cache = EntryCache(dispatcher.py_func)
        others = partial(held, cache.path.with_suffix(".lock"))
    compile_here = dispatcher.compile

    def compile_alone(signature: Any) -> Any:
        # The compiler's own lock comes first, so that two threads never wait for each other's.
        with global_compiler_lock, compiling(dispatcher.typingctx), others():
            return compile_here(signature)

    dispatcher.compile = compile_alone
    return dispatcher

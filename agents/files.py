"""Files and folders that appear whole or not at all: written under a temporary name, synced to disk, then renamed."""

from __future__ import annotations

import contextlib
import errno
import io
import json
import os
import secrets
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

UNSYNCABLE = (errno.EINVAL, errno.ENOTSUP)
"""Errors of file systems that cannot sync a folder."""


def write_whole(path: Path, write: Callable[[Path], Any]) -> Path:
    """Has `write` fill a temporary file beside `path` (same suffix) and renames it over `path`.

    A reader finds the old file or the new one, whenever this process or the machine ends. The file's mode is that of
    any new file, as the umask has it.

    Raises:
        OSError: the file cannot be written, with its name.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = _beside(path)
    try:
        os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        write(temporary)
        _sync(temporary)
        os.replace(temporary, path)
        _sync(path.parent)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        _name(error, path)
        raise
    return path


def write_folder(path: Path, write: Callable[[Path], Any]) -> Path:
    """Has `write` fill a temporary folder beside `path`, named ".NAME-...", and renames it to `path`.

    Raises:
        OSError: the folder cannot be written, with its name; or there is one that holds something.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = _beside(path)
    try:
        temporary.mkdir()
        write(temporary)
        for inside in temporary.iterdir():
            _sync(inside)
        _sync(temporary)
        os.replace(temporary, path)
        _sync(path.parent)
    except BaseException as error:
        shutil.rmtree(temporary, ignore_errors=True)
        _name(error, path)
        raise
    return path


def _beside(path: Path) -> Path:
    return path.with_name(f".{path.stem}-{secrets.token_hex(4)}{path.suffix}")


def _sync(path: Path) -> None:
    """Waits until a file or folder is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in UNSYNCABLE:
            raise
    finally:
        os.close(handle)


def _name(error: BaseException, path: Path) -> None:
    """Gives an operating system's error the name of what could not be written, where it has none."""
    if isinstance(error, OSError) and error.errno is not None and error.filename is None:
        error.filename = str(path)


def check_writable(folder: Path) -> None:
    """Makes a folder if need be, and raises OSError with a name unless files can be written there."""
    write_whole(folder / ".writable", lambda temporary: temporary.write_bytes(bytes(4096))).unlink(missing_ok=True)


def check_space(folder: Path, size: int) -> None:
    """Raises OSError with a folder's name unless the disk that it is on, or will be, has room for a number of bytes."""
    there = next(place for place in (folder.resolve(), *folder.resolve().parents) if place.exists())
    free = shutil.disk_usage(there).free
    if free < size:
        reason = f"{os.strerror(errno.ENOSPC)}: {size / 1e6:.0f} MB are needed, {free / 1e6:.0f} MB are free"
        raise OSError(errno.ENOSPC, reason, str(folder))


def write_text(path: Path, text: str) -> Path:
    """Writes a text file whole."""
    return write_whole(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))


def copy_whole(source: Path, target: Path) -> Path:
    """Copies a file whole."""
    return write_whole(target, lambda temporary: shutil.copyfile(source, temporary))


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> Path:
    """Writes a CSV file whole."""
    import csv

    def write(temporary: Path) -> None:
        with temporary.open("w", newline="", encoding="utf-8") as handle:
            writer = csv.writer(handle, lineterminator="\n")
            writer.writerow(header)
            writer.writerows(rows)

    return write_whole(path, write)


def write_json(path: Path, plain: Mapping[str, Any]) -> Path:
    """Writes a JSON object whole."""
    return write_text(path, json.dumps(dict(plain), indent=2) + "\n")


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file.

    Raises:
        OSError: the file cannot be opened.
        ValueError: the file is cut or altered, with its name.
    """
    plain = _parsed(path)
    if not isinstance(plain, dict):
        raise ValueError(f"{path} must hold a JSON object, got {type(plain).__name__}")
    return plain


def read_objects(path: Path) -> list[dict[str, Any]]:
    """The objects in the list that a JSON file holds. Raises as `read_json`."""
    plain = _parsed(path)
    if not isinstance(plain, list) or not all(isinstance(one, dict) for one in plain):
        raise ValueError(f"{path} must hold a JSON list of objects, got {type(plain).__name__}")
    return plain


def _parsed(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path} must hold JSON as it was written, got a damaged file: {error}") from error


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """All arrays of an .npz file, without pickles.

    Raises:
        OSError: the file cannot be opened.
        ValueError: the file is cut or altered, with its name.
    """
    content = io.BytesIO(path.read_bytes())
    try:
        with np.load(content, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    # A damaged zip raises nearly anything: a flipped bit in a size MemoryError, in a place OSError.
    except Exception as error:
        raise ValueError(f"{path} must be an .npz file as it was written, got a damaged one: {error}") from error

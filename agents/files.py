"""Files and folders that appear whole or not at all: written under a temporary name, then renamed."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from tempfile import NamedTemporaryFile, mkdtemp
from typing import Any


def write_whole(path: Path, write: Callable[[Path], Any]) -> Path:
    """Has `write` fill a temporary file beside `path` (same suffix) and renames it over `path`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with NamedTemporaryFile(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix, delete=False) as handle:
        temporary = Path(handle.name)
    try:
        write(temporary)
        temporary.chmod(0o644)
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return path


def write_folder(path: Path, write: Callable[[Path], Any]) -> Path:
    """Has `write` fill a temporary folder beside `path`, named ".NAME-...", and renames it to `path`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(mkdtemp(dir=path.parent, prefix=f".{path.name}-"))
    try:
        write(temporary)
        os.replace(temporary, path)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    return path


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

"""What stands beside every result: the machine and the versions that made it."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def machine() -> dict[str, str]:
    """Python, system and processor."""
    return {"python": platform.python_version(), "system": platform.system(), "processor": processor()}


def versions(*packages: str) -> dict[str, str]:
    """The installed packages' versions, without those that are missing."""
    return {name: found for name in packages if (found := _version(name))}


def processor() -> str:
    """The processor's name, as far as the system tells."""
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None

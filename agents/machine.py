"""Machine, versions of libraries, and the code that results depend on, which are written beside every result."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

ROOT = Path(__file__).parents[1]
CODE = (
    "elbow_gym/**/*.py",
    *(f"agents/{room}/*.py" for room in ("control", "evaluation", "planning")),
    "agents/tasks.py",
)
"""Patterns of the files that the results of an evaluation depend on."""
PICTURES = "rendering"
"""Folder of elbow_gym that only draws, so that no result depends on it."""
VECTORS = {
    "avx512f": "AVX-512, 8 doubles",
    "avx2": "AVX2, 4 doubles",
    "avx": "AVX, 4 doubles",
    "sse2": "SSE2, 2 doubles",
    "neon": "NEON, 2 doubles",
}
"""Name of each of LLVM's processor features, widest first."""


def machine() -> dict[str, str]:
    """Python, system, processor and the widest vectors that it computes with, which decide the kernel's speed."""
    return {
        "python": platform.python_version(),
        "system": platform.system(),
        "processor": processor(),
        "vectors": vectors(),
    }


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


def vectors() -> str:
    """The processor's widest vector instructions, as the kernel's compiler sees them; empty if none of these."""
    import llvmlite.binding as llvm

    features = llvm.get_host_cpu_features()
    return next((name for feature, name in VECTORS.items() if features.get(feature)), "")


@cache
def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


@cache
def code() -> str:
    """Digest of the files of `CODE`."""
    digest = hashlib.sha256()
    for pattern in CODE:
        for path in sorted(ROOT.glob(pattern)):
            if path.parent.name != PICTURES:
                digest.update(path.read_bytes())
    return digest.hexdigest()

"""Machine and versions of libraries, which are written beside every result."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

RESULTS = Path(__file__).parent / "results"
"""Folder of the tracked results."""
IGNORED = Path(__file__).parents[1] / ".benchmarks"
"""Folder of what git ignores."""
CACHE = IGNORED / "energy"
"""Folder of the energy benchmark's results, cell by cell; ignored by git."""
LATEST = CACHE / "latest"
"""Folder of the energy benchmark's last run that was not published; ignored by git."""
LATEST_SPEED = IGNORED / "speed" / "latest"
"""Folder of the speed benchmark's last run that was not published; ignored by git."""
PACKAGES = ("elbow-gym", "gymnasium", "numpy", "numba", "scipy", "stable-baselines3", "torch")
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

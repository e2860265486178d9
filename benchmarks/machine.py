"""Folders of the benchmarks' results, and the libraries whose versions are written beside them."""

from __future__ import annotations

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

"""Page in one file that loads nothing else: markup, style, script and data."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from html import escape
from importlib.metadata import version
from pathlib import Path

from agents.report import tables
from agents.report.colours import stylesheet
from agents.report.payload import payload
from agents.report.runs import Run

FOLDER = Path(__file__).parent / "web"
"""Folder of the page's markup, style and scripts."""
SCRIPTS = (
    "data",
    "state",
    "format",
    "scale",
    "svg",
    "chart",
    "bars",
    "camera",
    "scene",
    "replay",
    "pareto",
    "figures",
    "table",
    "main",
)
"""ES modules in the order of their dependences; in the page they share one scope."""
PACKAGES = ("elbow-gym", "numpy", "numba", "scipy", "gymnasium")
"""Packages whose versions the numbers depend on."""


def page(runs: Sequence[Run], results: Path) -> str:
    """The whole HTML document for the runs and the benchmark's results in a folder."""
    numbers = tables.paper_numbers(runs)
    parts = {
        "colours": stylesheet(run.controller for run in runs),
        "style": _read("page.css"),
        "headline": tables.headline(numbers, runs),
        "claims": tables.claims(numbers),
        "paper_table": tables.paper_table(numbers),
        "benchmark_table": tables.benchmark_table(results, runs),
        "versions": escape(", ".join(f"{name} {version(name)}" for name in PACKAGES)),
        # The text of a script element ends at the first "</".
        "data": json.dumps(payload(runs, results), separators=(",", ":"), allow_nan=False).replace("</", "<\\/"),
        "script": script(),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _read("page.html"))


def script() -> str:
    """The modules as one: without their imports and exports, which name each other."""
    sources = [_read(f"{name}.js") for name in SCRIPTS]
    return "\n".join(re.sub(r"^(import [^;]*;\n|export )", "", source, flags=re.MULTILINE) for source in sources)


def _read(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")

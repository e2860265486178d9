"""Generated tables in the READMEs: blocks of text between two comments that name them."""

from __future__ import annotations

from pathlib import Path

from agents.files import write_text

ROOT = Path(__file__).parents[1]
BLOCKS = {
    "agents/README.md": {"planners": "planners.md"},
    "README.md": {"energy": "energy_short.md"},
    "benchmarks/README.md": {
        "energy": "energy_brief.md",
        "breakdown": "breakdown.md",
        "learning": "learning.md",
        "builds": "builds.md",
        "tasks": "tasks.md",
        "disturbed": "tasks_disturbed.md",
        "speed": "speed_brief.md",
        "precision": "precision.md",
    },
}
"""Blocks of each README, and the file of the results that each is a copy of."""


def markers(name: str) -> tuple[str, str]:
    """The lines before and after a block."""
    return f"<!-- {name}:begin -->\n", f"<!-- {name}:end -->\n"


def block(text: str, name: str) -> str:
    """The text of a block.

    Raises:
        ValueError: its markers are not there, each once and in their order.
    """
    first, last = markers(name)
    if text.count(first) != 1 or text.count(last) != 1 or text.index(first) > text.index(last):
        raise ValueError(f"text must have {first.strip()} and then {last.strip()} once each, on lines of their own")
    return text[text.index(first) + len(first) : text.index(last)]


def replace_block(text: str, name: str, body: str) -> str:
    """The text with another body in a block. ValueError as of `block`."""
    first, last = markers(name)
    before = block(text, name)
    return text.replace(f"{first}{before}{last}", f"{first}{body}{last}")


def publish_blocks(results: Path, root: Path = ROOT) -> list[Path]:
    """Writes the tables of a folder of results into the READMEs' blocks.

    Returns:
        The READMEs that changed.

    Raises:
        ValueError: a README has not its markers; then none is written.
    """
    texts = {}
    for readme, blocks in BLOCKS.items():
        path = root / readme
        before = text = path.read_text(encoding="utf-8")
        for name, file in blocks.items():
            text = replace_block(text, name, (results / file).read_text(encoding="utf-8"))
        if text != before:
            texts[path] = text
    return [write_text(path, text) for path, text in texts.items()]

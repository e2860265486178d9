"""Texts of tyro: its help in lines of the terminal's width, and its errors in one line."""

from __future__ import annotations

import re
import shutil
import textwrap
from typing import Any, TextIO

COLOUR = re.compile(r"\x1b\[[\d;]*m")


class Wrapped:
    """Stream that breaks the lines that are wider than the terminal: usages and descriptions, since frames are not.

    Args:
        stream: what is written to, and asked whether it is a terminal's.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._width = stream, shutil.get_terminal_size().columns

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Writes lines or parts of lines; of a part that is broken the colours are left out."""
        for line in text.splitlines(keepends=True):
            plain = COLOUR.sub("", line)
            bare = plain.rstrip("\n")
            if len(bare) > self._width:
                indent = " " * 4 if bare.startswith("usage") else ""
                line = textwrap.fill(bare, self._width, subsequent_indent=indent, break_long_words=False)  # noqa: PLW2901
                line += plain[len(bare) :]  # noqa: PLW2901
            self._stream.write(line)
        return len(text)


def one_line(box: str) -> str:
    """The reason in tyro's framed message, with the options or words that could be meant; the rest is left out."""
    # Colours, and drawn or blank frames, follow the terminal.
    plain = COLOUR.sub("", box)
    lines = re.findall(r"^(?:│ |  )(.*?)[ │]*$", plain, re.MULTILINE) or plain.splitlines()
    end = next((k for k, line in enumerate(lines) if not line.strip("─-")), None)
    # Help texts are indented by eight.
    reason = " ".join(line.strip() for line in lines[:end] if not line.startswith(" " * 8))
    reason = reason.removeprefix("Error parsing ").rstrip(".")
    # An option's own rule follows its name; a group's name is left out, since its rule names the option.
    reason = re.sub(r"^(--[\w-]+): (?=must)", r"\1 ", re.sub(r"^[a-z]\w*: ", "", reason))
    if not reason.startswith("Unrecognized"):
        return reason
    meant = [line.split()[0].rstrip(",") for line in lines if re.match(" {4}--", line)]
    if "misplaced" in reason:
        places = dict.fromkeys(re.findall(r"^ {8}in .* (\w+) --help$", "\n".join(lines), re.MULTILINE))
        return f"{', '.join(meant)} must come after {' or '.join(places)}"
    known = [line.removeprefix("Available subcommands: ") for line in lines if line.startswith("Available subcommands")]
    more = [f"perhaps {' or '.join(meant)} is meant"] if meant else []
    return "; ".join([reason, *more, *(f"known: {names}" for names in known)])

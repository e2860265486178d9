"""Help of the commands: usages and descriptions are broken at the terminal's width, frames and colours stay."""

import io

import pytest

from agents.__main__ import app
from agents.tyro_text import Wrapped


@pytest.fixture
def narrow(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


def test_long_lines_are_broken_and_others_stay_as_they_are(narrow):
    stream = io.StringIO()
    frame = "\x1b[2m│\x1b[0m " + "x" * 76 + " \x1b[2m│\x1b[0m\n"
    text = "usage: " + "word " * 20 + "\n\n" + "plain " * 20 + "\n" + frame + "end"
    assert Wrapped(stream).write(text) == len(text)
    usage, more, blank, plain, second, *rest = stream.getvalue().split("\n")
    assert (usage, more, blank) == ("usage:" + " word" * 14, "   " + " word" * 6, "")
    assert (plain, second) == ("plain" + " plain" * 12, "plain" + " plain" * 6)
    assert rest == [frame.rstrip("\n"), "end"]


@pytest.mark.parametrize("command", ["evaluate", "reproduce", "export"])
def test_help_keeps_to_the_terminals_width(narrow, capsys, command):
    with pytest.raises(SystemExit):
        app.run([command, "--help"])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].startswith(f"usage: python -m agents {command}")

"""Commands of a program: the first word chooses one, errors end with a line, and each has its own help."""

import errno
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Literal

import pytest

from agents.cli import Commands, Count, JsonObject, Seed, spelled

ROOT = Path(__file__).parents[2]
COMMANDS = {
    "agents": (
        "reproduce",
        "train",
        "clone",
        "newton",
        "sweep",
        "best",
        "publish",
        "evaluate",
        "bound",
        "bounds",
        "verify",
        "export",
        "dataset",
        "report",
        "watch",
    ),
    "benchmarks": ("energy", "learning", "optimal", "planners", "speed", "tasks"),
}


NOTHING = {}


@pytest.fixture
def app():
    app = Commands("program", "What it is for.")

    @app.command
    def add(first: Seed, count: Count = 1, more: JsonObject = NOTHING, sign: Literal["plus", "minus"] = "plus") -> None:
        """Adds numbers.

        A second paragraph.

        Args:
            first: First number, whose text is so long that the line breaks in the source, where a reader of the help
                sees none.
            count: Number of numbers.
            more: More numbers by name.
            sign: Operation.
        """
        print(first, count, more, sign)

    @app.command_from
    def echo(words):
        """Says a word that depends on the words."""

        def said(loud: bool = "loud" in words, word: str = "") -> None:
            if word == "bad":
                raise ValueError("word must be good, got bad")
            print(loud, word)

        return said

    return app


def test_first_word_chooses_the_command_and_the_others_are_its_options(app, capsys):
    app.run(["add", "--first", "3", "--more", '{"a": 1}', "--sign", "minus"])
    app.run(["echo", "--word", "loud"])
    assert capsys.readouterr().out == "3 1 {'a': 1} minus\nTrue loud\n"


def test_parsing_makes_no_call(app, capsys):
    call = app.parse(["add", "--first", "3"])
    assert capsys.readouterr().out == ""
    call()
    assert capsys.readouterr().out == "3 1 {} plus\n"


@pytest.mark.parametrize("word", ["-h", "--help"])
def test_help_lists_the_commands_with_a_line_each(app, capsys, word):
    with pytest.raises(SystemExit) as end:
        app.run([word])
    assert end.value.code == 0
    said = capsys.readouterr().out
    assert "usage: program [-h] COMMAND ..." in said
    assert "\n  add   Adds numbers.\n  echo  Says a word that depends on the words.\n" in said
    assert "second paragraph" not in said


def test_help_of_a_command_joins_the_lines_of_an_argument(app, capsys):
    with pytest.raises(SystemExit) as end:
        app.run(["add", "--help"])
    assert end.value.code == 0
    said = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "usage: program add [-h] --first INT [--count INT] [--more JSON]" in said
    assert "A second paragraph." in said
    assert "where a reader of the help sees none." in said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "command must be one of add, echo, got none"),
        (["ad"], "command must be one of add, echo, got ad"),
        (["add"], "Missing from program add: --first INT; see program add --help"),
        (["add", "--first", "-1"], "--first must be an integer of at least 0, got -1; see program add --help"),
        (["add", "--first", "1", "--count", "0"], "--count must be a positive integer, got 0; see program add --help"),
        (["add", "--first", "1", "--count", "x"], "--count must be a positive integer, got x; see program add --help"),
        (
            ["add", "--first", "1", "--more", "[]"],
            "--more must be a JSON object such as '{\"duration\": 10}', got []; see program add --help",
        ),
        (
            ["add", "--first", "1", "--sign", "times"],
            "invalid choice 'times' for argument '--sign'. Expected one of ('plus', 'minus'); see program add --help",
        ),
        (
            ["add", "--first", "1", "--cout", "2"],
            "Unrecognized options: --cout, 2; perhaps --count is meant; see program add --help",
        ),
    ],
)
def test_wrong_words_end_with_one_line_and_status_two(app, capsys, words, message):
    with pytest.raises(SystemExit) as end:
        app.run(words)
    assert end.value.code == 2
    assert capsys.readouterr().err == f"error: {message}\n"


def test_refusal_by_the_command_ends_with_one_line(app):
    with pytest.raises(SystemExit, match=r"^error: word must be good, got bad$"):
        app.run(["echo", "--word", "bad"])


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (OSError(errno.ENOSPC, "No space left on device", "runs/a"), "No space left on device: runs/a"),
        (PermissionError(errno.EACCES, "Permission denied", "runs"), "Permission denied: runs"),
        (FileNotFoundError(errno.ENOENT, "No such file or directory", b"runs"), "No such file or directory: runs"),
        (ChildProcessError("a worker process was killed"), "a worker process was killed"),
    ],
)
def test_error_of_the_system_ends_with_one_sentence(app, error, line):
    @app.command
    def fail() -> None:
        """Fails as files do."""
        raise error

    with pytest.raises(SystemExit, match=f"^error: {line}$"):
        app.run(["fail"])


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_signal_ends_with_the_shells_code_and_without_a_traceback(app, capsys, number, code):
    cleaned = []

    @app.command
    def hang() -> None:
        """Waits for a signal."""
        try:
            os.kill(os.getpid(), number)
            time.sleep(60.0)
        finally:
            cleaned.append(number)

    before = signal.getsignal(number)
    with pytest.raises(SystemExit) as end:
        app.run(["hang"])
    assert (end.value.code, cleaned) == (code, [number])
    assert capsys.readouterr().err == ""
    assert signal.getsignal(number) is before


def test_what_is_said_to_a_terminal_that_is_gone_is_dropped():
    code = (
        "import os, signal; from agents.cli import forget_lost_terminal;"
        "signal.signal(signal.SIGHUP, signal.SIG_IGN);"
        "open('ready', 'w').close(); input();"
        "forget_lost_terminal(); print('lost', flush=True); open('done', 'w').close()"
    )
    pty = pytest.importorskip("pty")
    with tempfile.TemporaryDirectory() as folder:
        terminal, side = pty.openpty()
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        pipes = {"stdin": subprocess.PIPE, "stdout": side, "stderr": side, "cwd": folder, "env": environment}
        process = subprocess.Popen([sys.executable, "-c", code], **pipes)
        os.close(side)
        while not (Path(folder) / "ready").exists():
            time.sleep(0.01)
        os.close(terminal)
        process.communicate(b"go\n")
        assert process.returncode == 0
        assert (Path(folder) / "done").exists()


def test_signal_that_a_parent_has_set_to_be_ignored_stays_ignored(app):
    @app.command
    def go_on() -> None:
        """Is not ended by the terminal's end, as under nohup."""
        os.kill(os.getpid(), signal.SIGHUP)

    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        app.run(["go_on"])
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.parametrize(
    ("word", "shown"),
    [
        ("/home/ada/thesis/first", "first"),
        ("--output=/home/ada/runs", "--output=runs"),
        ("~/runs", "runs"),
        ("../ada/runs", "runs"),
        (r"C:\Users\ada\runs", "runs"),
        ("runs/first", "runs/first"),
        ("0.002", "0.002"),
    ],
)
def test_command_lines_for_cards_hold_no_folders_of_a_user(word, shown):
    assert spelled("agents", "train", ["ppo", word]) == f"python -m agents train ppo {shown}"


def test_line_is_plain_on_a_coloured_terminal():
    pty = pytest.importorskip("pty")
    terminal, stdout = pty.openpty()
    words = [sys.executable, "-m", "agents", "train", "ppo", "--seeds", "0"]
    ran = subprocess.run(words, cwd=ROOT, stdout=stdout, stderr=subprocess.PIPE, check=False)
    os.close(stdout)
    os.close(terminal)
    assert ran.returncode == 2
    assert ran.stderr == b"error: --seeds must be a positive integer, got 0; see python -m agents train --help\n"


SAYING = """
from agents.cli import Commands
app = Commands("program", "What it is for.")
@app.command
def say(lines: int) -> None:
    for line in range(lines):
        print(line)
app.run()
"""


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize(
    "words",
    [
        ["-m", "agents", "--help"],
        ["-m", "agents", "train", "ppo", "--help"],
        ["-c", SAYING, "say", "--lines", "1"],
        ["-c", SAYING, "say", "--lines", "100000"],
    ],
    ids=["programs-help", "commands-help", "line", "lines"],
)
def test_output_that_nobody_reads_ends_without_a_traceback(words, unbuffered):
    reader, writer = os.pipe()
    os.close(reader)
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    command = [sys.executable, *words]
    ran = subprocess.run(command, cwd=ROOT, env=environment, stdout=writer, stderr=subprocess.PIPE, check=False)
    os.close(writer)
    assert (ran.returncode, ran.stderr) == (1, b"")


def test_broken_pipe_of_something_else_is_not_hidden(app, capsys):
    @app.command
    def film() -> None:
        """Writes into a pipe that nobody reads."""
        raise BrokenPipeError("film")

    with pytest.raises(BrokenPipeError, match="film"):
        app.run(["film"])


HEAVY = ("numba", "torch", "scipy", "matplotlib", "stable_baselines3", "rich")
ASKED = [
    *((program, *words) for program, names in COMMANDS.items() for words in ([], *([name] for name in names))),
    ("agents", "train", "ppo"),
    ("agents", "train", "ppo", "--elbows", "1"),
]
"""Words that help is asked for, the program's name first."""
ASKING = f"""
import contextlib, io, json, runpy, sys
from importlib.util import find_spec
said = []
for words in {ASKED}:
    sys.argv = [*words, "--help"]
    # Boxes are drawn where the encoding has them.
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2))
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            runpy.run_path(find_spec(words[0] + ".__main__").origin, run_name="__main__")
        except SystemExit as end:
            code = end.code
    said.append((code, *(text.buffer.getvalue().decode() for text in (out, err))))
print(json.dumps([said, [name for name in {HEAVY} if name in sys.modules]]))
"""


def said_by(*words):
    environment = {**os.environ, "PYTHONUTF8": "1", "COLUMNS": "80"}
    command = [sys.executable, *words]
    ran = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, encoding="utf-8", check=False)
    assert ran.returncode == 0, ran.stderr
    assert ran.stderr == ""
    return ran.stdout


@pytest.fixture(scope="module")
def asked():
    """What all the helps are, by their words, and the heavy libraries that they loaded; one process says it all."""
    said, loaded = json.loads(said_by("-c", ASKING))
    return dict(zip(ASKED, said, strict=True)), loaded


@pytest.fixture
def help_of(asked):
    """Gives the help of words, the program's name first."""

    def given(*words):
        code, out, err = asked[0][words]
        assert (code, err) == (0, "")
        return out

    return given


@pytest.mark.parametrize("program", COMMANDS)
def test_help_of_a_program_lists_its_commands(program, help_of):
    said = help_of(program)
    assert said == said_by("-m", program, "--help")
    assert said.startswith(f"usage: python -m {program} ")
    assert re.findall(r"^  (\w+) +\S", said, re.MULTILINE) == list(COMMANDS[program])
    assert max(map(len, said.splitlines())) <= 80


@pytest.mark.parametrize(("program", "command"), [(name, one) for name, all_ in COMMANDS.items() for one in all_])
def test_help_of_a_command_shows_its_own_usage(program, command, help_of):
    said = help_of(program, command)
    assert said.startswith(f"usage: python -m {program} {command} [-h]")
    assert said.count("usage:") == 1


def groups(said):
    """Names of the options by the title of their box."""
    boxes = re.findall(r"╭─ ([\w ]+?) ─+╮\n(.*?)╰", said, re.DOTALL)
    return {title: set(re.findall(r"^│ (--[\w-]+)", body, re.MULTILINE)) for title, body in boxes}


def test_help_of_an_algorithm_groups_its_options_apart_and_shows_the_defaults_that_apply(help_of):
    found = groups(said := help_of("agents", "train", "ppo"))
    assert found["task options"] == {"--env", "--elbows", "--arm", "--environment"}
    assert {"--seeds", "--output", "--label"} <= found["run options"]
    assert {"--total-timesteps", "--gamma", "--clip-range"} <= found["algorithm options"]
    assert "--tau" not in said
    flat = " ".join(help_of("agents", "train", "ppo", "--elbows", "1").replace("│", " ").split())
    assert "summed over all arms. (default: 5000000)" in flat
    assert "summed over all arms. (default: 2500000)" in " ".join(said.replace("│", " ").split())


def test_help_loads_no_compiler_and_no_learning_library(asked):
    assert asked[1] == []

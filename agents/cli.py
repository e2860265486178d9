"""Command line of a program: its first word chooses a command, and tyro parses the others once."""

from __future__ import annotations

import inspect
import io
import json
import os
import re
import shlex
import signal
import sys
import textwrap
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from functools import partial
from pathlib import PurePosixPath, PureWindowsPath
from typing import Annotated, Any, NoReturn, get_type_hints

import tyro
from tyro.conf import CascadeSubcommandArgs
from tyro.constructors import PrimitiveConstructorSpec

from agents.tyro_text import Wrapped, one_line

HELP = ("-h", "--help")
WIDTH = 80
"""Width of the list of commands [characters]."""

Function = Callable[..., Any]
"""Command: its arguments are the options, its docstring is the help."""


class Commands:
    """Commands of a program. Only the parser of the command that is asked for is built.

    Args:
        prog: words that start the program, such as "python -m agents".
        summary: a sentence for the help.
    """

    def __init__(self, prog: str, summary: str) -> None:
        self._prog, self._summary = prog, summary
        self._functions: dict[str, Callable[[Sequence[str]], Function]] = {}
        self._summaries: dict[str, str] = {}

    def command(self, function: Function) -> Function:
        """Adds a function as the command of its name."""
        self._add(function, lambda _: function)
        return function

    def command_from(self, choose: Callable[[Sequence[str]], Function]) -> Callable[[Sequence[str]], Function]:
        """Adds a command whose function, such as the defaults of its arguments, depends on the words after its name.

        Args:
            choose: returns the function for these words; has the name and the summary of the command.
        """
        self._add(choose, choose)
        return choose

    def _add(self, named: Function, choose: Callable[[Sequence[str]], Function]) -> None:
        self._functions[named.__name__] = choose
        self._summaries[named.__name__] = (named.__doc__ or "").strip().split("\n")[0]

    def run(self, words: Sequence[str] | None = None) -> None:
        """Runs a command; an error that the user or the system made, or a missing extra, ends with one line on stderr.

        Args:
            words: the command line after the program's name; that of this process when None.

        Raises:
            SystemExit: 0 after help, 2 if the words cannot be parsed, 1 if the command refused what they say, if the
                system refused a file, or if nobody reads the output to its end, as in
                `python -m agents --help | head -1`; 130 after Ctrl-C, 143 after SIGTERM, 129 after SIGHUP.
        """
        with _ending_signals() as ended:
            try:
                try:
                    self.parse(sys.argv[1:] if words is None else words)()
                finally:
                    sys.stdout.flush()
            except SystemExit:
                raise
            except KeyboardInterrupt:
                sys.exit(128 + next(iter(ended), signal.SIGINT))
            except BrokenPipeError:
                if _has_reader():
                    raise
                sys.exit(1)
            except _users_errors() as error:
                sys.exit(f"error: {sentence(error)}")

    def parse(self, words: Sequence[str]) -> Callable[[], Any]:
        """The call that a command line asks for, not made yet.

        Raises:
            SystemExit: 0 after help, 2 with one line on stderr if the words cannot be parsed.
        """
        if words and words[0] in HELP:
            print(self.help())
            sys.exit(0)
        if not words or words[0] not in self._functions:
            _refuse(f"command must be one of {', '.join(self._functions)}, got {words[0] if words else 'none'}")
        name, *rest = words
        return parse(self._functions[name](rest), f"{self._prog} {name}", rest)

    def help(self) -> str:
        """The program's usage, and its commands with a line each."""
        left = 2 + max(map(len, self._summaries))
        wrapper = textwrap.TextWrapper(WIDTH, subsequent_indent=" " * (left + 2))
        commands = [wrapper.fill(f"  {name:{left}}{summary}") for name, summary in self._summaries.items()]
        usage = f"usage: {self._prog} [-h] COMMAND ..."
        more = f"`{self._prog} COMMAND --help` lists the options of a command."
        return "\n".join((usage, "", textwrap.fill(self._summary, WIDTH), "", "commands:", *commands, "", more))


def parse(function: Function, prog: str, words: Sequence[str]) -> Callable[[], Any]:
    """The call of a function that a command line asks for, not made yet.

    Args:
        function: its arguments are the options, its docstring is the help.
        prog: words that start the command, for the usage.
        words: the command line after `prog`.

    Raises:
        SystemExit: 0 after help, 2 with one line on stderr if the words cannot be parsed.
    """

    def call(*positional: Any, **named: Any) -> Callable[[], Any]:
        return partial(function, *positional, **named)

    call.__signature__ = inspect.signature(function)  # type: ignore[attr-defined]
    call.__annotations__ = get_type_hints(function, include_extras=True)
    # The lines of an argument's text are joined, which tyro would print as they are.
    call.__doc__ = re.sub(r"\n {8}", " ", inspect.getdoc(function) or "")
    said = io.StringIO()
    try:
        with redirect_stderr(said), redirect_stdout(Wrapped(sys.stdout)):
            return tyro.cli(call, prog=prog, args=words, config=(CascadeSubcommandArgs,))
    except SystemExit as end:
        if not end.code:
            raise
    _refuse(f"{one_line(said.getvalue())}; see {prog} --help")


def spelled(package: str, command: str, words: Sequence[str]) -> str:
    """The command line as a shell takes it, for files that a command writes; of a user's folders the last name alone.

    Args:
        package: what `python -m` runs.
        command: name of the command.
        words: the command line after it.
    """
    return shlex.join(["python", "-m", package, command, *map(_without_folders, words)])


@contextmanager
def _ending_signals() -> Iterator[list[int]]:
    """Has SIGTERM and SIGHUP end the block as Ctrl-C does, and yields a list for the one that came.

    What a parent has set, such as `nohup`, stays.
    """
    came: list[int] = []

    def end(number: int, _: Any) -> None:
        came.append(number)
        forget_lost_terminal()
        raise KeyboardInterrupt

    names = ("SIGTERM", "SIGHUP") if threading.current_thread() is threading.main_thread() else ()
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    taken = [number for number in numbers if signal.getsignal(number) is signal.SIG_DFL]
    for number in taken:
        signal.signal(number, end)
    try:
        yield came
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_DFL)


def forget_lost_terminal() -> None:
    """Drops what is still said to a terminal that is gone, where every word would raise an error."""
    for handle in (1, 2):
        try:
            os.write(handle, b"")
        except OSError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, handle)
            os.close(nowhere)


def sentence(error: BaseException) -> str:
    """An error's message; of the operating system's errors the reason and the file."""
    if isinstance(error, OSError) and error.strerror is not None:
        name = os.fsdecode(error.filename) if isinstance(error.filename, bytes) else error.filename
        return error.strerror if name is None else f"{error.strerror}: {name}"
    return str(error)


def _without_folders(word: str) -> str:
    option, equals, value = word.partition("=") if word.startswith("--") else ("", "", word)
    for kind in (PurePosixPath, PureWindowsPath):
        path = kind(value)
        if path.is_absolute() or value.startswith("~") or ".." in path.parts:
            return option + equals + path.name
    return word


def _refuse(reason: str) -> NoReturn:
    print(f"error: {reason}", file=sys.stderr)
    sys.exit(2)


def _has_reader() -> bool:
    """Whether stdout is read, found out by ending the line; if not, the rest of the output is dropped."""
    try:
        print(flush=True)
    except BrokenPipeError:
        # Python flushes once more at its end, and would print a traceback.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
        return False
    return True


def _users_errors() -> tuple[type[Exception], ...]:
    # Evaluated once something was raised: help needs no Gymnasium.
    from gymnasium.error import DependencyNotInstalled

    return ValueError, OSError, DependencyNotInstalled


def _integer(rule: str, least: int, none: bool = False) -> PrimitiveConstructorSpec[Any]:
    def parsed(words: list[str]) -> int | None:
        if none and words[0] == "None":
            return None
        if not re.fullmatch(r"[+-]?\d+", words[0]) or int(words[0]) < least:
            raise ValueError(f"must be {rule}, got {words[0]}")
        return int(words[0])

    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="INT",
        instance_from_str=parsed,
        is_instance=lambda value: isinstance(value, int) or (none and value is None),
        str_from_instance=lambda value: [str(value)],
    )


JSON_RULE = "a JSON object such as '{\"duration\": 10}'"


def _json_object(words: list[str]) -> dict[str, Any]:
    try:
        plain = json.loads(words[0])
    except json.JSONDecodeError as error:
        after = f", which is no JSON from character {error.pos + 1} on"
        raise ValueError(f"must be {JSON_RULE}, got {words[0]}{after}") from error
    if not isinstance(plain, dict):
        raise ValueError(f"must be {JSON_RULE}, got {words[0]}")
    return plain


Count = Annotated[int, _integer("a positive integer", 1)]
"""Option whose value is at least 1."""
CountOrNone = Annotated[int | None, _integer("a positive integer", 1, none=True)]
"""Option whose value is at least 1, or None."""
Seed = Annotated[int, _integer("an integer of at least 0", 0)]
"""Option whose value is at least 0."""
JsonObject = Annotated[
    dict[str, Any],
    PrimitiveConstructorSpec(
        nargs=1,
        metavar="JSON",
        instance_from_str=_json_object,
        is_instance=lambda value: isinstance(value, dict),
        str_from_instance=lambda value: [json.dumps(value)],
    ),
]
"""Option whose value is a JSON object."""

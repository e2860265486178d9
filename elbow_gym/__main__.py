"""The command line: `python -m elbow_gym compile`, `verify` and `info`."""

from __future__ import annotations

import argparse
import os
import sys
import time
from typing import Any

import numpy as np

VARIANTS: dict[str, dict[str, Any]] = {
    "paper": {},
    "table": {"elbows": 0, "table": True},
    "rubbing": {"elbow_friction": 0.2},
    "drive": {"supply_resistance": 0.1},
    "rough": {"elbow_friction": 0.2, "supply_resistance": 0.1},
    "rk4": {"integrator": "rk4"},
}
"""Arguments of an environment for each kernel that can be named: what is off is not compiled."""
SIZES = {"single": 1, "batch": 3}
"""Numbers of arms that take a kernel of one lane, and one of whole blocks."""


def compile_kernels(variants: list[str], sizes: list[str]) -> None:
    """Compiles kernels into the cache, one line each, and removes what earlier sources have left there."""
    from elbow_gym.kernel.cache import folder, remove_stale
    from elbow_gym.vector_env import ElbowArmVectorEnv

    for variant in variants:
        for size in sizes:
            started = time.perf_counter()
            env = ElbowArmVectorEnv(SIZES[size], **VARIANTS[variant])
            env.reset(seed=0)
            env.step(np.zeros(env.action_space.shape or (), np.float32))
            print(f"{variant}, {size}: ready after {time.perf_counter() - started:.1f} s", flush=True)
    place = folder()
    print(f"cache: {'nowhere, no folder can be written' if place is None else place}")
    removed = 0 if place is None else remove_stale(place)
    print(f"removed {removed} files of other sources")


def run_verify() -> None:
    """Checks the installation; exits with code 1 where something is wrong."""
    from elbow_gym.verification import verify

    if not verify():
        raise SystemExit(1)


def print_info() -> None:
    """Prints the ids, arguments, observations and the cache's folder."""
    from elbow_gym.description import describe
    from elbow_gym.verification import ids

    print(describe(ids()))


def main(words: list[str] | None = None) -> None:
    """Parses a command line and carries it out."""
    parser = argparse.ArgumentParser(prog="python -m elbow_gym", description="Tools of an installation of elbow_gym.")
    commands = parser.add_subparsers(dest="command", required=True)
    help_text = "compile the kernel into Numba's cache before it is needed, and remove stale files"
    command = commands.add_parser("compile", help=help_text, description=help_text)
    command.add_argument(
        "variants", nargs="*", metavar="variant", help=f"of {', '.join(VARIANTS)}; paper when none is given"
    )
    command.add_argument(
        "--size", choices=[*SIZES, "both"], default="both", help="for one or two arms, for larger batches, or both"
    )
    for name, text in (
        ("verify", "check the installation: a line for each check, exit code 1 where one fails"),
        ("info", "print ids, arguments, the observation's entries and the cache's folder"),
    ):
        commands.add_parser(name, help=text, description=text)
    given = parser.parse_args(words)
    if given.command != "compile":
        return {"verify": run_verify, "info": print_info}[given.command]()
    unknown = [name for name in given.variants if name not in VARIANTS]
    if unknown:
        command.error(f"variant must be one of {', '.join(VARIANTS)}, got {unknown[0]}")
    compile_kernels(given.variants or ["paper"], list(SIZES) if given.size == "both" else [given.size])


def run(words: list[str]) -> None:
    """Carries out a command line; Ctrl-C, and an output that takes nothing more, end it without a traceback."""
    try:
        try:
            main(words)
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:
        # Python flushes the output once more at its end.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        sys.exit(f"error: {error.strerror or error}")


if __name__ == "__main__":
    run(sys.argv[1:])

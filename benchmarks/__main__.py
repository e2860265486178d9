"""The command line: `python -m benchmarks energy` and `python -m benchmarks speed`."""

from __future__ import annotations

import sys
from pathlib import Path

import tyro

from benchmarks.energy import RESULTS

app = tyro.extras.SubcommandApp()


@app.command
def energy(output: Path = RESULTS, episodes: int = 20) -> None:
    """Every controller in the regimes A, B and C: table, CSV, JSON and a figure.

    Args:
        output: folder for the results.
        episodes: start poses, one fixed seed each.
    """
    from benchmarks.energy import energy as run

    run(output, episodes)


@app.command
def speed(output: Path = RESULTS, quick: bool = False) -> None:
    """This project against MuJoCo, Pinocchio, NumPy and Gymnasium: table, CSV, JSON and a figure.

    Args:
        output: folder for the results.
        quick: few and short samples, to see that all works.
    """
    from benchmarks.speed import speed as run

    run(output, quick)


def main() -> None:
    """Runs a command; a wrong argument ends with one line that says what is wrong."""
    try:
        app.cli(prog="python -m benchmarks", description=__doc__)
    except ValueError as error:
        sys.exit(f"error: {error}")


if __name__ == "__main__":
    main()

"""The command line: `python -m benchmarks energy | optimal | speed`."""

from __future__ import annotations

from pathlib import Path

import tyro

from agents.cli import run
from benchmarks.energy import RESULTS

app = tyro.extras.SubcommandApp()


@app.command
def energy(output: Path = RESULTS, episodes: int = 20) -> None:
    """Every controller in the regimes A, B and C: table, CSV, JSON and a figure.

    Args:
        output: folder for the results.
        episodes: start poses, one fixed seed each.
    """
    from benchmarks.energy import energy as measure_energy

    measure_energy(output, episodes)


@app.command
def optimal(output: Path = RESULTS, fresh: bool = False, workers: int = 2, front: bool = True) -> None:
    """The best possible return for each elbow count, and the front of energy against tracking error.

    Args:
        output: folder for the results; what was solved there before is kept.
        fresh: solve everything again.
        workers: processes, one problem each.
        front: also the energy weights beside the default one.
    """
    from benchmarks.optimal import optimal as solve_optimal

    solve_optimal(output, fresh, workers, front)


@app.command
def speed(output: Path = RESULTS, quick: bool = False) -> None:
    """This project against MuJoCo, Pinocchio, NumPy and Gymnasium: table, CSV, JSON and a figure.

    Args:
        output: folder for the results.
        quick: few and short samples, to see that all works.
    """
    from benchmarks.speed import speed as measure_speed

    measure_speed(output, quick)


if __name__ == "__main__":
    run(app, "python -m benchmarks", __doc__)

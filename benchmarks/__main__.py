"""The command line: `python -m benchmarks energy | learning | optimal | speed`."""

from __future__ import annotations

from pathlib import Path

import tyro

from agents.cli import run
from agents.shipped import CURVES, OPTIMA
from benchmarks.machine import RESULTS

app = tyro.extras.SubcommandApp()


@app.command
def energy(output: Path = RESULTS, episodes: int = 20, fresh: bool = False) -> None:
    """Every controller in the regimes A, B and C: tables, CSV, JSON and figures.

    An interrupted run goes on where it stopped: what was measured with the same code and files is not measured again.

    Args:
        output: folder for the results.
        episodes: start poses, one fixed seed each.
        fresh: measure everything again.
    """
    from benchmarks.energy.run import energy as measure_energy

    measure_energy(output, episodes, fresh)


@app.command
def learning(output: Path = RESULTS, curves: Path = CURVES) -> None:
    """The learning curves against steps and seconds, and when the PD was beaten: figure, CSV and table.

    Args:
        output: folder of the results, with energy.csv.
        curves: folder of the learning curves.
    """
    from benchmarks.learning import save

    for row in save(output, curves):
        print("  ".join(row))


@app.command
def optimal(
    output: Path = RESULTS, optima: Path = OPTIMA, fresh: bool = False, workers: int = 2, front: bool = True
) -> None:
    """The best possible return for each elbow count, the same under the table, and the front of energy against error.

    Args:
        output: folder for the summary.
        optima: folder of the solutions; what was solved there before is kept.
        fresh: solve everything again.
        workers: processes, one problem each.
        front: also the energy weights beside the default one.
    """
    from benchmarks.optimal import optimal as solve_optimal

    solve_optimal(output, optima, fresh, workers, front)


@app.command
def speed(output: Path = RESULTS, quick: bool = False) -> None:
    """This project against MuJoCo, Pinocchio, NumPy and Gymnasium: table, CSV, JSON and a figure.

    Args:
        output: folder for the results.
        quick: few and short samples, to see that all works.
    """
    from benchmarks.speed.run import speed as measure_speed

    measure_speed(output, quick)


if __name__ == "__main__":
    run(app, "python -m benchmarks", __doc__)

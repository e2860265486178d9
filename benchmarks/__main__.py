"""The command line: `python -m benchmarks energy | learning | optimal | speed`."""

from __future__ import annotations

from pathlib import Path

import tyro

from agents.cli import run
from benchmarks.machine import LATEST, RESULTS

app = tyro.extras.SubcommandApp()


@app.command
def energy(
    output: Path = LATEST, episodes: int | None = None, fresh: bool = False, full: bool = False, publish: bool = False
) -> None:
    """Energy and error of every controller with two, one and no elbow on the table, in the regimes A, B and C.

    By default three start poses and one policy of each learned controller, in about a minute of CPU time. An
    interrupted run goes on where it stopped: what was measured with the same code and files is not measured again.

    Args:
        output: folder for the tables and figures.
        episodes: start poses, one fixed seed each; 3, or 20 of a full run, when not given.
        fresh: measure everything again.
        full: all parts, start poses and training seeds.
        publish: a full run whose results go to benchmarks/results and into the tables of the READMEs.
    """
    from benchmarks.energy.run import energy as measure_energy

    measure_energy(output, episodes, fresh, full, publish)


@app.command
def learning(output: Path = RESULTS) -> None:
    """The learning curves against steps and seconds, and when the PD was beaten: figure, CSV and table.

    Args:
        output: folder of the results, with the curves in learning/ and energy.csv.
    """
    from benchmarks.learning import save

    for row in save(output):
        print("  ".join(row))


@app.command
def optimal(output: Path = RESULTS, fresh: bool = False, workers: int = 2, front: bool = True) -> None:
    """The best possible return for each elbow count, the same under the table, and the front of energy against error.

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
    from benchmarks.speed.run import speed as measure_speed

    measure_speed(output, quick)


if __name__ == "__main__":
    run(app, "python -m benchmarks", __doc__)

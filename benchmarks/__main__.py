"""Commands of the benchmarks: `python -m benchmarks energy | learning | optimal | speed`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from agents.cli import Commands, Count, spelled
from agents.shipped import CURVES, OPTIMA
from benchmarks.machine import LATEST, LATEST_SPEED, RESULTS

app = Commands("python -m benchmarks", "Benchmarks of energy, learning, the optimum and the simulator's speed.")


@app.command_from
def energy(words: Sequence[str]) -> Callable[..., None]:
    """Energy and error of every controller with two, one and no elbow on the table, in the regimes A, B and C."""

    def energy(
        output: Path = LATEST,
        episodes: Count | None = None,
        fresh: bool = False,
        full: bool = False,
        publish: bool = False,
    ) -> None:
        """Energy and error of every controller with two, one and no elbow on the table, in the regimes A, B and C.

        By default three start poses and one policy of each learned controller, in about a minute of CPU time. An
        interrupted run goes on where it stopped: what was measured with the same code and files is not measured again.

        Args:
            output: Folder for the tables and figures.
            episodes: Number of start poses, each from a fixed seed; 3, or 20 of a full run, when None.
            fresh: Whether to measure everything again.
            full: Whether to play all parts, start poses and training seeds.
            publish: Whether to play everything and write the results to benchmarks/results and the READMEs' tables.
        """
        from benchmarks.energy.run import energy as measure_energy

        measure_energy(output, episodes, fresh, full, publish, command=spelled("benchmarks", "energy", words))

    return energy


@app.command
def learning(output: Path = RESULTS, curves: Path = CURVES) -> None:
    """Learning curves against control periods and seconds, and when the PD was beaten: figure, CSV and table.

    Args:
        output: Folder of the results, with energy.csv.
        curves: Folder of the learning curves.
    """
    from benchmarks.learning import save

    for row in save(output, curves):
        print("  ".join(row))


@app.command
def optimal(
    output: Path = RESULTS, optima: Path = OPTIMA, fresh: bool = False, workers: Count = 2, front: bool = True
) -> None:
    """Best known return for each elbow count, also with the space under the table, and the front of energy and error.

    Args:
        output: Folder for the summary.
        optima: Folder of the solutions; problems that were solved there before are kept.
        fresh: Whether to solve everything again.
        workers: Number of processes; each solves one problem at a time.
        front: Whether to solve for other energy weights than the default one too.
    """
    from benchmarks.optimal import optimal as solve_optimal

    solve_optimal(output, optima, fresh, workers, front)


@app.command_from
def speed(words: Sequence[str]) -> Callable[..., None]:
    """This project against MuJoCo, Pinocchio, NumPy and Gymnasium: tables, CSV, JSON and figures."""

    def speed(output: Path = LATEST_SPEED, quick: bool = False, publish: bool = False) -> None:
        """This project against MuJoCo, Pinocchio, NumPy and Gymnasium: tables, CSV, JSON and figures.

        Args:
            output: Folder for the results.
            quick: Whether to take few and short samples, which show that everything runs.
            publish: Whether to write the results to benchmarks/results and the READMEs' tables.
        """
        from benchmarks.speed.run import speed as measure_speed

        measure_speed(output, quick, publish, command=spelled("benchmarks", "speed", words))

    return speed


if __name__ == "__main__":
    app.run()

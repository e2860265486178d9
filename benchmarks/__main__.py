"""Commands of the benchmarks: `python -m benchmarks energy | learning | optimal | planners | speed | tasks`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, UseAppendAction, arg

from agents.cli import Commands, Count, CountOrNone, JsonObject, spelled
from agents.jobs.machines import Machines
from agents.shipped import CURVES, OPTIMA
from agents.task_options import Elbows, TaskOptions
from benchmarks.machine import CACHE, LATEST, LATEST_SPEED, RESULTS

MACHINES = Machines()
app = Commands("python -m benchmarks", "Benchmarks of energy, learning, the optimum and the simulator's speed.")


@app.command_from
def energy(words: Sequence[str]) -> Callable[..., None]:
    """Energy and error of every controller with two, one and no elbow on the table, in the regimes A, B and C."""

    def energy(
        output: Path = LATEST,
        episodes: CountOrNone = None,
        fresh: bool = False,
        full: bool = False,
        publish: bool = False,
        players: Annotated[UseAppendAction[tuple[str, ...]], arg(name="with", metavar="WHAT")] = (),
        elbows: Elbows = None,
        arm: Path | None = None,
        environment: JsonObject | None = None,
        trust: bool = False,
        machines: OmitArgPrefixes[Machines] = MACHINES,
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
            players: Player of your own, as `python -m agents evaluate --help` says, for a row beside the others; may be
                given several times.
            elbows: Elbows on the table, a number up to 2 or joint numbers such as 4,7; all of 2, 1 and 0 when None.
            arm: JSON file of your own arm, on which the classical controllers and your players are compared.
            environment: Further arguments of your own environment, such as '{"payload": 0.1}', in which the same play.
            trust: Whether to read a .zip, whose pickles can run any code when they are read.
            machines: Machines.
        """
        from benchmarks.energy.own import measure_own

        measure_own(
            TaskOptions(elbows=elbows, arm=arm, environment=environment or {}), players, trust, output=output,
            episodes=episodes, fresh=fresh, full=full, publish=publish, command=spelled("benchmarks", "energy", words),
            machines=machines, folder=CACHE if machines.storage is None else machines.place(Path("energy")),
        )  # fmt: skip

    return energy


@app.command
def learning(
    output: Path = RESULTS,
    curves: Path = CURVES,
    against: Path | None = None,
    python: Path | None = None,
    seeds: Count = 5,
) -> None:
    """Learning curves against control periods and seconds, and when the PD was beaten: figure, CSV and table.

    Shows this build beside another one, too: PPO's time until the PD is beaten, and where it goes.

    Args:
        output: Folder of the results, with energy.csv.
        curves: Folder of the learning curves.
        against: Checkout of another build, with which this one trains in turn, for about a quarter of an hour of CPU
            time; what was measured before is shown when None.
        python: Interpreter with that build's libraries; this one when None.
        seeds: Number of training seeds of each build and elbow count.
    """
    from benchmarks import builds
    from benchmarks.learning import save

    if against is not None:
        builds.measure(against, python, seeds, output)
    for row in (*save(output, curves), *builds.save(output)):
        print("  ".join(row))


@app.command
def optimal(
    output: Path = RESULTS,
    optima: Path = OPTIMA,
    fresh: bool = False,
    front: bool = True,
    machines: OmitArgPrefixes[Machines] = MACHINES,
) -> None:
    """Best known return for each elbow count, also with the space under the table, and the front of energy and error.

    Args:
        output: Folder for the summary.
        optima: Folder of the solutions; problems that were solved there before are kept.
        fresh: Whether to solve everything again.
        front: Whether to solve for other energy weights than the default one too.
        machines: Machines.
    """
    from benchmarks.optimal import optimal as solve_optimal

    solve_optimal(output, machines.place(optima), fresh, machines, front)


@app.command
def planners(
    output: Path = LATEST,
    drawn: Count = 10,
    elbows: tuple[int, ...] = (2, 1, 0),
    publish: bool = False,
    machines: OmitArgPrefixes[Machines] = MACHINES,
) -> None:
    """Receding-horizon and sampling control beside policies, computed torque and the bound, also on evaluation tasks.

    Takes half an hour of CPU time; what was played with the same code is not played again.

    Args:
        output: Folder for the table.
        drawn: Number of evaluation tasks at each elbow count, the first of those that are solved.
        elbows: Elbows on the table in the evaluation tasks, of 0, 1 and 2.
        publish: Whether to write the results to benchmarks/results and the table into the README.
        machines: Machines.
    """
    from benchmarks.planners import planners as measure_planners

    print(measure_planners(output, drawn, elbows, publish, machines))


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


@app.command
def tasks(
    output: Path = LATEST,
    elbows: tuple[int, ...] = (2, 1, 0),
    seed: int | None = None,
    solve: bool = False,
    starts: Count = 2,
    planners: bool = False,
    disturb: bool = False,
    players: Annotated[UseAppendAction[tuple[str, ...]], arg(name="with", metavar="WHAT")] = (),
    trust: bool = False,
    publish: bool = False,
    machines: OmitArgPrefixes[Machines] = MACHINES,
) -> None:
    """How far every player stays from the optimum of each evaluation task of ElbowArmTasks-v0, or of other ones.

    Some minutes of CPU time without the planners; what was played with the same code is not played again. The
    optima are those in benchmarks/results/tasks_optima.csv, of other tasks in tasks_SEED_optima.csv.

    Args:
        output: Folder for the tables and the figure.
        elbows: Elbows on the table, of 2, 1 and 0.
        seed: Seed of the first of fifty other tasks; the evaluation tasks when None.
        solve: Whether to find the optima that are not in the file yet, instead of playing; about 25 to 50 s of CPU
            time each. Every one is written as it is found, so that an interrupted run goes on where it stopped.
        starts: Number of postures that --solve starts a task from. Tasks that were solved from fewer are solved again,
            and the cheaper solution stays.
        planners: Whether the planners play, too, those that estimate the payload, and undisturbed: an hour of CPU time.
        disturb: Whether everybody also plays with constants off by 10 %, sensor noise, delay, and an untold payload.
        players: Player of your own, as `python -m agents evaluate --help` says, for a row beside the others; may be
            given several times, with one LABEL= for the training seeds of one.
        trust: Whether to read a .zip, whose pickles can run any code when they are read.
        publish: Whether to write the results to benchmarks/results, and those of the evaluation tasks into the README;
            these need --planners and --disturb.
        machines: Machines.
    """
    from benchmarks.tasks.task_set import EVALUATION, TaskSet

    drawn = EVALUATION if seed is None else TaskSet(seed)
    if solve:
        from benchmarks.tasks.optima import solve as solve_tasks

        print(solve_tasks(elbows, starts, machines, drawn))
        return
    from benchmarks.tasks.run import tasks as play_tasks

    print(play_tasks(output, elbows, players, planners, disturb, trust, publish, machines, drawn))


if __name__ == "__main__":
    app.run()

"""The command line: `python -m agents reproduce | train | clone | publish | evaluate | watch | report`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import tyro

from agents.cli import run
from agents.learning.clone_settings import CloneSettings
from agents.learning.command import train_command

CLONE = CloneSettings()

app = tyro.extras.SubcommandApp()


@app.command
def reproduce(output: Path = Path("reproduction"), publish: bool = False, table: bool = False) -> None:
    """The paper's three cases: Figs 1-25, the series, the numbers and a verdict on each of its claims.

    Args:
        output: folder for figures, CSV files and the verdict.
        publish: also refresh the README's picture and the committed numbers.
        table: instead ask on a real table, which gives way and cannot pull, whether leaning on it saves energy: three
            start poses under three frictions.
    """
    if table:
        from agents.paper.table_claims import reproduce_on_table

        reproduce_on_table(output, publish=publish)
        return
    from agents.paper.cases import reproduce as reproduce_paper

    reproduce_paper(output, publish=publish)


app.command(train_command(sys.argv[1:]), name="train")


@app.command
def clone(
    elbows: int = 2,
    seeds: int = 1,
    first_seed: int = 0,
    resume: bool = False,
    output: Path = Path("runs"),
    trajectory: Path | None = None,
    settings: Annotated[CloneSettings, tyro.conf.arg(name="")] = CLONE,
) -> None:
    """Clones the optimal trajectory and the LQR around it into networks, one folder OUTPUT/clone_elbowsN_seedK a seed.

    Args:
        elbows: elbows on the table.
        seeds: how many networks.
        first_seed: the first of the seeds.
        resume: seeds that are finished are left alone, the others start anew.
        output: folder of the runs.
        trajectory: what is cloned; the benchmark's optimum for the elbow count when not given.
        settings: of the imitation.
    """
    from agents.control.trajectory import OPTIMA
    from agents.learning.clone import clone_all
    from elbow_gym.task.settings import Settings

    chosen = list(range(first_seed, first_seed + seeds))
    folders = [output / f"clone_elbows{elbows}_seed{seed}" for seed in chosen]
    source = OPTIMA / f"elbows{elbows}.npz" if trajectory is None else trajectory
    command = " ".join(["python -m agents", *sys.argv[1:]])
    results = clone_all(Settings(elbows=elbows), source, settings, chosen, folders, command, resume)
    for result in results.values():
        print(f"{result['name']}: {result['training_seconds']:.0f} s, return {result['best']['return']:.2f}")


@app.command
def publish(runs: tyro.conf.Positional[tuple[Path, ...]], /, replace_seeds: bool = False) -> None:
    """Takes finished runs over: best policies into agents/policies, curves into benchmarks/results/learning.

    Args:
        runs: folders of the runs, as the training named them.
        replace_seeds: also remove the shipped seeds of the same algorithm and task that are not among them.
    """
    from agents.learning.publish import publish as publish_runs

    for name in publish_runs(runs, replace_seeds=replace_seeds):
        print(name)


@app.command
def evaluate(
    policy: tyro.conf.Positional[str], /, elbows: int | None = None, env: str = "ElbowArm-v0", episodes: int = 20
) -> None:
    """Plays a controller in the regimes A, B and C and prints what it cost.

    Args:
        policy: "pd", "pd_paper", "pd_smooth", "pd_gravity", "computed_torque", "computed_torque_posture", the algorithm
            of a shipped policy ("ppo"), or the path of a policy.
        elbows: elbows on the table; the policy's own, or 2, when not given.
        env: the environment's id, unless the policy is a path.
        episodes: start poses, one fixed seed each.
    """
    from tqdm import tqdm

    from agents.evaluation.players import find_player
    from agents.evaluation.regimes import BENCHMARK_SEEDS, in_all_regimes, print_results

    player = find_player(policy, elbows, env)
    seeds = [BENCHMARK_SEEDS[0] + k for k in range(episodes)]
    with tqdm(total=100, unit="%", desc=policy, file=sys.stderr) as bar:

        def advance(done: int, total: int) -> None:
            bar.update(100 * done // total - bar.n)

        results = in_all_regimes(player, seeds, advance)
    elbow_joints = player.settings.elbow_joints
    print_results(f"{player.label}, elbows {elbow_joints}, {episodes} episodes: mean ± standard deviation", results)


@app.command
def report(output: Path = Path("report.html")) -> None:
    """One HTML file to look at: every controller's run to replay, the paper's Figs 1-25 and the benchmark.

    Args:
        output: the file; it opens without a network.
    """
    from agents.report.command import report as write_report

    write_report(output)


@app.command
def watch(
    controller: tyro.conf.Positional[str],
    /,
    versus: str | None = None,
    elbows: int | None = None,
    env: str = "ElbowArm-v0",
    start: Literal["paper", "on_target"] = "paper",
    seed: int = 0,
    speed: float = 1.0,
    size: tuple[int, int] = (640, 480),
    output: Path | None = None,
) -> None:
    """Shows a controller at work in a window, in real time; without a display it writes a video instead.

    Args:
        controller: as for `evaluate`.
        versus: another controller beside it, with the same start and in step.
        elbows: elbows on the table; the environment's own number when not given.
        env: id of the environment; a policy's file brings its own.
        start: "paper": the paper's start pose; "on_target": the hand starts on the circle.
        seed: of the start pose.
        speed: seconds of the arm in one second.
        size: width and height of each controller's picture in pixels.
        output: a .gif or .mp4 to write instead of opening a window.
    """
    from agents.watch.watch import watch as watch_controllers

    names = [controller] if versus is None else [controller, versus]
    written = watch_controllers(
        names, env=env, elbows=elbows, start=start, seed=seed, speed=speed, size=size, output=output
    )
    if written is not None:
        print(written)


if __name__ == "__main__":
    run(app, "python -m agents", __doc__)

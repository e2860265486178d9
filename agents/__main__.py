"""Commands of the agents: `python -m agents reproduce | train | clone | publish | evaluate | watch | report`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from agents.cli import Commands, Count, Seed

app = Commands("python -m agents", "Controllers of the arm: training, evaluation, pictures, the paper's results.")


@app.command
def reproduce(output: Path = Path("reproduction"), publish: bool = False, table: bool = False) -> None:
    """The paper's three cases: Figs 1-25, the series, the numbers and a verdict on each of its claims.

    Args:
        output: Folder for figures, CSV files and the verdict.
        publish: Whether to refresh the pictures of the READMEs and the committed numbers too.
        table: Whether to play on a compliant table instead, which cannot pull, from three start poses under three
            frictions, with a verdict on whether leaning saves energy.
    """
    if table:
        from agents.paper.table_claims import reproduce_on_table

        reproduce_on_table(output, publish=publish)
        return
    from agents.paper.cases import reproduce as reproduce_paper

    reproduce_paper(output, publish=publish)


@app.command_from
def train(words: Sequence[str]) -> Callable[..., None]:
    """Trains PPO or SAC agents, several seeds side by side."""
    from agents.learning.command import train_command

    return train_command(words)


@app.command_from
def clone(words: Sequence[str]) -> Callable[..., None]:
    """Clones the optimal trajectory and the LQR around it into networks."""
    from agents.learning.command import clone_command

    return clone_command(words)


@app.command
def publish(
    runs: Annotated[tuple[Path, ...], Positional, arg(metavar="FOLDER [FOLDER ...]")],
    /,
    replace_seeds: bool = False,
    allow_worse: bool = False,
) -> None:
    """Takes finished runs over into the shipped policies and learning curves; a task's best seed is its baseline.

    Args:
        runs: Folders of the runs, as the training named them.
        replace_seeds: Whether to remove the shipped seeds of the same algorithm and task that are not among the runs.
        allow_worse: Whether a shipped policy may give way to one with a worse return; otherwise that is refused.
    """
    from agents.learning.publish import publish as publish_runs

    for name in publish_runs(runs, replace_seeds=replace_seeds, allow_worse=allow_worse):
        print(name)


@app.command
def evaluate(
    policy: Annotated[str, Positional, arg(metavar="POLICY")],
    /,
    elbows: int | None = None,
    env: str = "ElbowArm-v0",
    episodes: Count = 20,
) -> None:
    """Plays a controller in the regimes A, B and C and prints what it cost.

    Args:
        policy: Controller: "pd", "pd_paper", "pd_smooth", "pd_gravity", "computed_torque", "computed_torque_posture",
            the algorithm of a shipped policy ("ppo"), or the path of a policy.
        elbows: Number of elbows on the table; that of the environment, or of the policy's file, when None.
        env: Gymnasium id of the environment; a policy's file brings its own.
        episodes: Number of episodes, each with a start pose of its own from a fixed seed.
    """
    from tqdm import tqdm

    from agents.evaluation.players import find_player
    from agents.evaluation.regimes import BENCHMARK_SEEDS, in_all_regimes, print_results

    player = find_player(policy, elbows, env)
    seeds = [BENCHMARK_SEEDS[0] + k for k in range(episodes)]
    # Percent alone: tqdm's rate would be in percent per second.
    with tqdm(total=100, desc=policy, bar_format="{l_bar}{bar}| {elapsed} < {remaining}", file=sys.stderr) as bar:

        def advance(done: int, total: int) -> None:
            bar.update(100 * done // total - bar.n)

        results = in_all_regimes(player, seeds, advance)
    elbow_joints = player.settings.elbow_joints
    print_results(f"{player.label}, elbows {elbow_joints}, {episodes} episodes: mean ± standard deviation", results)


@app.command
def report(output: Path = Path("report.html")) -> None:
    """Writes one HTML page: replays of every controller, the paper's Figs 1-25 and the benchmark.

    Args:
        output: File of the page, which opens without a network.
    """
    from agents.report.command import report as write_report

    write_report(output)


@app.command
def watch(
    controller: Annotated[str, Positional, arg(metavar="CONTROLLER")],
    /,
    versus: str | None = None,
    elbows: int | None = None,
    env: str = "ElbowArm-v0",
    start: Literal["paper", "on_target"] = "paper",
    seed: Seed = 0,
    speed: float = 1.0,
    size: tuple[int, int] = (640, 480),
    output: Path | None = None,
) -> None:
    """Shows a controller at work in a window, in real time; without a display it writes a video instead.

    Args:
        controller: Controller, by a name that `python -m agents evaluate --help` lists, or the path of a policy.
        versus: Second controller, which is shown beside the first with the same start and in step.
        elbows: Number of elbows on the table; that of the environment, or of the policy's file, when None.
        env: Gymnasium id of the environment; a policy's file brings its own.
        start: Start pose: "paper" for the paper's, "on_target" for one whose hand is on the circle.
        seed: Seed of the start pose.
        speed: Simulated time per second of real time [s/s].
        size: Width and height of each controller's picture [pixels].
        output: File to write instead of opening a window, .gif or .mp4.
    """
    from agents.watch.watch import watch as watch_controllers

    names = [controller] if versus is None else [controller, versus]
    written = watch_controllers(
        names, env=env, elbows=elbows, start=start, seed=seed, speed=speed, size=size, output=output
    )
    if written is not None:
        print(written)


if __name__ == "__main__":
    app.run()

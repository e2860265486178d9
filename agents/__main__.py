"""The command line: `python -m agents reproduce | train | evaluate`."""

from __future__ import annotations

import sys
from pathlib import Path

import tyro

from agents.cli import run
from agents.train_command import train_command

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
        from agents.tabletop_report import reproduce_on_table

        reproduce_on_table(output, publish=publish)
        return
    from agents.reproduce import reproduce as reproduce_paper

    reproduce_paper(output, publish=publish)


app.command(train_command(sys.argv[1:]), name="train")


@app.command
def evaluate(policy: tyro.conf.Positional[str], /, elbows: int | None = None, episodes: int = 20) -> None:
    """Plays a controller in the regimes A, B and C and prints what it cost.

    Args:
        policy: "pd", "pd_paper", "pd_smooth", "pd_gravity", "computed_torque", "computed_torque_posture", the algorithm
            of a shipped policy ("ppo"), or the path of a policy.
        elbows: elbows on the table; the policy's own, or 2, when not given.
        episodes: start poses, one fixed seed each.
    """
    from tqdm import tqdm

    from agents.evaluate import BENCHMARK_SEEDS, in_all_regimes, named_controller, print_results

    settings, make = named_controller(policy, elbows)
    seeds = [BENCHMARK_SEEDS[0] + k for k in range(episodes)]
    with tqdm(total=200, unit="%", desc=policy, file=sys.stderr) as bar:

        def advance(done: int, total: int) -> None:
            bar.update(1)

        results = in_all_regimes(settings, make, seeds, advance)
    print_results(f"{policy}, elbows {settings.elbow_joints}, {episodes} episodes: mean ± standard deviation", results)


@app.command
def report(output: Path = Path("report.html")) -> None:
    """One HTML file to look at: every controller's run to replay, the paper's Figs 1-25 and the benchmark.

    Args:
        output: the file; it opens without a network.
    """
    from agents.report import report as write_report

    write_report(output)


if __name__ == "__main__":
    run(app, "python -m agents", __doc__)

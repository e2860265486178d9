"""The command line: `python -m agents reproduce | train | evaluate`."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Literal

import tyro

from agents.cli import run
from agents.train import PPOSettings

DEFAULT_PPO = PPOSettings()

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


@app.command
def train(
    algorithm: tyro.conf.Positional[Literal["ppo"]],
    /,
    elbows: int = 2,
    seed: int = 0,
    output: Path | None = None,
    environment: str = "{}",
    checkpoint_every: int = 100_000,
    minutes: float | None = None,
    ppo: Annotated[PPOSettings, tyro.conf.arg(name="")] = DEFAULT_PPO,
) -> None:
    """Trains an agent; Ctrl-C keeps the best policy so far.

    Args:
        algorithm: the algorithm.
        elbows: elbows on the table.
        seed: of networks, sampling and arms.
        output: folder for the policy, checkpoints and logs; runs/ALGORITHM_elbowsN_seedS when not given.
        environment: more arguments of the environment as a JSON object, such as '{"energy_weight": 0.002}'.
        checkpoint_every: control periods between two evaluations and checkpoints.
        minutes: ends the training after so many.
        ppo: the algorithm's settings.
    """
    from agents.keeper import sentence
    from agents.train import train_ppo
    from elbow_gym.settings import Settings

    settings = Settings(**{"elbows": elbows, **json.loads(environment)})
    folder = Path("runs") / f"{algorithm}_elbows{elbows}_seed{seed}" if output is None else output
    print(f"{algorithm} with {elbows} elbows, seed {seed}, into {folder}: {asdict(ppo)}")
    policy = train_ppo(settings, ppo, seed, folder, checkpoint_every, minutes)
    figures = {key: value for key, value in policy.card.evaluation.items() if key != "seeds"}
    print(f"best: {sentence(figures)}\n{folder / 'best.json'}")


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


if __name__ == "__main__":
    run(app, "python -m agents", __doc__)

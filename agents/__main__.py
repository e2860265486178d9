"""Commands of the agents: `python -m agents COMMAND`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, UseAppendAction, arg

from agents.cli import Commands, Count, Seed
from agents.task_options import Elbows, TaskOptions

TASK = TaskOptions()
app = Commands("python -m agents", "Controllers of the arm: training, evaluation, pictures, the paper's results.")


@app.command
def reproduce(
    elbows: Elbows = 2,
    arm: Path | None = None,
    output: Path = Path("reproduction"),
    publish: bool = False,
    table: bool = False,
) -> None:
    """The paper's cases: Figs 1-25, the series, the numbers and a verdict on each of its claims, on any arm.

    Args:
        elbows: Elbows of the case that has most, 1 or 2 as in the paper or the joints' numbers, such as 4 or 4,7; each
            further case has one less, the outermost.
        arm: JSON file of another arm, as `ArmParameters.to_dict` has it. Its circle is one in its reach, and nothing is
            compared with the paper's numbers.
        output: Folder for figures, CSV files and the verdict.
        publish: Whether to refresh the pictures of the READMEs and the committed numbers too.
        table: Whether to play on a compliant table instead, which cannot pull, from start poses under three
            frictions, with a verdict on whether leaning saves energy.
    """
    from agents.paper.command import reproduce as reproduce_cases
    from agents.paper.subject import Subject

    reproduce_cases(Subject(2 if elbows is None else elbows, arm), output, publish, table)


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


@app.command_from
def newton(words: Sequence[str]) -> Callable[..., None]:
    """Trains one policy for drawn tasks on Newton's steps from its own motions."""
    from agents.learning.command import newton_command

    return newton_command(words)


@app.command_from
def sweep(words: Sequence[str]) -> Callable[..., None]:
    """Compares algorithms, elbows, settings and arguments of the environment over seeds: a table and a figure."""
    from agents.sweep.command import sweep_command

    return sweep_command(words)


@app.command_from
def best(words: Sequence[str]) -> Callable[..., None]:
    """Trains the best trial of each task of a sweep, and publishes it if asked for."""
    from agents.sweep.command import best_command

    return best_command(words)


@app.command_from
def publish(words: Sequence[str]) -> Callable[..., None]:
    """Takes finished runs over into the shipped policies and learning curves; a task's best seed is its baseline."""
    from agents.learning.command import publish_command

    return publish_command(words)


@app.command
def evaluate(
    players: Annotated[tuple[str, ...], Positional, arg(metavar="WHAT [WHAT ...]", help_behavior_hint="(required)")],
    /,
    task: OmitArgPrefixes[TaskOptions] = TASK,
    episodes: Count = 20,
    trust: bool = False,
    receipt: bool = False,
) -> None:
    """Plays controllers in the regimes A, B and C and prints what they cost.

    WHAT is a name of the registry ("pd", "computed_torque", "ppo"; a wrong one lists all), the folder of a training
    run, a policy's file, a Stable-Baselines3 .zip, an .onnx file, or module:callable of a controller or of what makes
    one for an environment; LABEL=WHAT gives it a name. Policies bring their environment.

    Args:
        players: Controllers.
        task: Environment.
        episodes: Number of episodes, each with a start pose of its own from a fixed seed.
        trust: Whether to read a .zip, whose pickles can run any code when they are read.
        receipt: Whether to print, instead of a table, a line for `python -m agents verify`: settings, seeds, digest and
            joules.
    """
    from agents.evaluation.command import evaluate_all

    evaluate_all(players, task, episodes, trust, receipt)


@app.command_from
def bound(words: Sequence[str]) -> Callable[..., None]:
    """Finds the best known solution of any task without contact, with its certificate; solved tasks are kept."""
    from agents.optimal.options import bound

    return bound


@app.command_from
def bounds(words: Sequence[str]) -> Callable[..., None]:
    """Finds the bounds of many tasks side by side and writes a CSV; run it again to go on after an interruption."""
    from agents.optimal.options import bounds

    return bounds


@app.command
def verify(receipt: str | None = None, trust: bool = False) -> None:
    """Checks a checkout, or plays the episodes of a receipt again; exit code 1 where something is wrong.

    The checks are those of `python -m elbow_gym verify`, the shipped policies against their cards, and the PD's joules
    with two, one and no elbow on the table, a line each. Episodes agree to the last bit on the same machine, versions
    and code, and to 1e-6 elsewhere.

    Args:
        receipt: Line of `python -m agents evaluate --receipt`, or a file that holds it; all checks when None.
        trust: Whether to read a .zip, whose pickles can run any code when they are read.
    """
    from agents.verification import verify as verify_all

    if not verify_all(receipt, trust):
        raise SystemExit(1)


@app.command
def export(
    policy: Annotated[str, Positional, arg(metavar="WHAT")],
    output: Annotated[Path, Positional, arg(metavar="FILE.onnx")],
    /,
    task: OmitArgPrefixes[TaskOptions] = TASK,
    trust: bool = False,
) -> None:
    """Writes a policy as an ONNX file, with its contract beside it, and checks that both act alike.

    The contract, FILE.onnx.json, names the entries of the observation, their scales and limits, the action's unit, the
    rate, the supply and the environment.

    Args:
        policy: Shipped algorithm such as "ppo", folder of a run, policy's file, or Stable-Baselines3 .zip.
        output: File to write.
        task: Environment of a .zip, and of the shipped policy that is meant.
        trust: Whether to read a .zip, whose pickles can run any code when they are read.
    """
    from agents.learning.export import export as export_policy

    print(export_policy(policy, output, task, trust))


@app.command
def dataset(
    player: Annotated[str, Positional, arg(metavar="WHAT")],
    name: Annotated[str, Positional, arg(metavar="NAME")],
    /,
    task: OmitArgPrefixes[TaskOptions] = TASK,
    episodes: Count = 40,
    seed: Seed = 0,
    noise: float = 0.0,
    trust: bool = False,
) -> None:
    """Records a player's episodes as a Minari data set, in the folder that MINARI_DATASETS_PATH names.

    Args:
        player: Controller, as for `evaluate`.
        name: Minari's id of the data set, such as "elbow_gym/ppo-v0".
        task: Environment.
        episodes: Number of episodes.
        seed: Seed of the first start; the others' follow.
        noise: Standard deviation of normal noise on the actions, as a share of the largest.
        trust: Whether to read a .zip, whose pickles can run any code when they are read.
    """
    from agents.evaluation.dataset import record_episodes, write_dataset
    from agents.evaluation.players import find_player

    found = find_player(player, task.elbows, task.env, task.arguments(), trust)
    data = write_dataset(found, name, record_episodes(found, episodes, seed, noise))
    print(f"{name}: {data.total_episodes} episodes, {data.total_steps} steps")


@app.command
def report(
    output: Path = Path("report.html"),
    players: Annotated[UseAppendAction[tuple[str, ...]], arg(name="with", metavar="WHAT")] = (),
    trust: bool = False,
) -> None:
    """Writes one HTML page: replays of every controller, the paper's Figs 1-25 and the benchmark.

    Args:
        output: File of the page, which opens without a network.
        players: Player of your own, as `python -m agents evaluate --help` says, beside the others; may be given several
            times. Its numbers are of one episode without start noise.
        trust: Whether to read a .zip, whose pickles can run any code when they are read.
    """
    from agents.evaluation.guest import Guest
    from agents.report.command import report as write_report

    write_report(output, guests=[Guest.named(name, trust) for name in players])


@app.command
def watch(
    controller: Annotated[str, Positional, arg(metavar="WHAT")],
    /,
    versus: str | None = None,
    task: OmitArgPrefixes[TaskOptions] = TASK,
    start: Literal["paper", "on_target"] = "paper",
    seed: Seed = 0,
    speed: float = 1.0,
    size: tuple[int, int] = (640, 480),
    output: Path | None = None,
    trust: bool = False,
) -> None:
    """Shows a controller at work in a window, in real time; without a display it writes a video instead.

    Args:
        controller: Controller, as `python -m agents evaluate --help` says.
        task: Environment.
        versus: Second controller, which is shown beside the first with the same start and in step.
        start: Start pose: "paper" for the paper's, "on_target" for one whose hand is on the circle.
        seed: Seed of the start pose.
        speed: Simulated time per second of real time [s/s].
        size: Width and height of each controller's picture [pixels].
        output: File to write instead of opening a window, .gif or .mp4.
        trust: Whether to read a .zip, whose pickles can run any code when they are read.
    """
    from agents.watch.watch import watch as watch_controllers

    names = [controller] if versus is None else [controller, versus]
    players = {"env": task.env, "elbows": task.elbows, "arguments": task.arguments(), "trust": trust, "tell": task.tell}
    shown = {"start": start, "seed": seed, "speed": speed, "size": size}
    written = watch_controllers(names, output=output, **players, **shown)
    if written is not None:
        print(written)


if __name__ == "__main__":
    app.run()

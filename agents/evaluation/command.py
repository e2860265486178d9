"""Commands `python -m agents evaluate` and `verify`."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from agents.evaluation.effort import decision_time
from agents.evaluation.own import KINDS
from agents.evaluation.players import find_player, known_names
from agents.evaluation.receipt import player_again, read_receipt, receipt, verify
from agents.evaluation.regimes import BENCHMARK_SEEDS, in_all_regimes, print_results
from agents.style import leaning_in_words
from agents.task_options import TaskOptions


def evaluate_all(names: Sequence[str], task: TaskOptions, episodes: int, trust: bool, receipts: bool) -> None:
    """Plays controllers one after the other and prints a table for each.

    Args:
        names: controllers, as `find_player` takes them.
        task: environment.
        episodes: number of episodes, each with a start pose of its own from a fixed seed.
        trust: whether files that may run code when they are read may be read.
        receipts: whether to print a line for each that `verify_receipt` takes, and no table.

    Raises:
        ValueError: there is no such controller, or it does not fit the environment; nothing was played then.
    """
    if not names:
        raise ValueError(f"WHAT must be at least one of {', '.join(known_names(task.elbows, task.env))}, or {KINDS}")
    arguments = task.arguments()
    players = {name: find_player(name, task.elbows, task.env, arguments, trust) for name in names}
    seeds = [BENCHMARK_SEEDS[0] + k for k in range(episodes)]
    for name, player in players.items():
        task.tell(player.settings)
        with _bar(player.name) as advance:
            results = in_all_regimes(player, seeds, advance)
        if receipts:
            asked = {"what": name, "env": task.env, "elbows": task.elbows, "arguments": arguments}
            print(json.dumps(receipt(asked, player, seeds, results)))
            continue
        elbows = leaning_in_words(player.settings.elbow_joints)
        print_results(f"{player.label}, {elbows}, {episodes} episodes: mean ± standard deviation", results)
        print(f"A decision takes {1e3 * decision_time(player):.3g} ms of CPU time here, for one arm.")


def verify_receipt(word: str, trust: bool) -> None:
    """Plays a receipt's episodes again and prints how closely they agree. Raises ValueError where they do not.

    Args:
        word: the receipt's line, or a file that holds it.
        trust: whether a file that may run code when it is read may be read.
    """
    given = read_receipt(word)
    player = player_again(given, trust)
    with _bar(player.name) as advance:
        said = verify(given, player, advance)
    print(f"{player.label}: {said}")


@contextmanager
def _bar(title: str) -> Iterator[Callable[[int, int], None]]:
    """A bar on stderr, and the callback that moves it."""
    from tqdm import tqdm

    # Percent alone: tqdm's rate would be in percent per second.
    with tqdm(total=100, desc=title, bar_format="{l_bar}{bar}| {elapsed} < {remaining}", file=sys.stderr) as bar:
        yield lambda done, total: bar.update(100 * done // total - bar.n)

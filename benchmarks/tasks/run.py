"""Comparison of all players on the evaluation tasks, against each task's optimum."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from agents.files import write_csv, write_text, write_whole
from agents.jobs.job import Job
from agents.jobs.machines import Machines, do_all
from agents.style import ELBOW_NAMES
from agents.workers import compile_before
from benchmarks.blocks import publish_blocks
from benchmarks.machine import CACHE, RESULTS
from benchmarks.tasks.contenders import Contender, contenders
from benchmarks.tasks.episodes import DISTURBANCES, NOMINAL, UNITS, played
from benchmarks.tasks.optima import file_of, optimal_figures
from benchmarks.tasks.report import disturbed_table, figure, table, write_scores
from benchmarks.tasks.scores import Episodes, Key, scores
from benchmarks.tasks.task_set import EVALUATION, TaskSet


def tasks(
    output: Path,
    elbows: Sequence[int],
    guests: Sequence[str] = (),
    planners: bool = False,
    disturb: bool = False,
    trust: bool = False,
    publish: bool = False,
    machines: Machines | None = None,
    drawn: TaskSet = EVALUATION,
    optima: Path | None = None,
    folder: Path = CACHE,
) -> str:
    """Plays everybody on the tasks of a set that are solved; writes tables, CSV and a figure. Returns the tables.

    Args:
        output: folder of the results, unless they are published.
        elbows: elbow counts.
        guests: players of the user's own, WHAT or LABEL=WHAT.
        planners: whether the planners play, undisturbed.
        disturb: whether everybody also plays under the `DISTURBANCES`.
        trust: whether files that may run code when they are read may be read.
        publish: whether the results go to benchmarks/results, and the tables into the README.
        machines: what plays.
        drawn: the set.
        optima: file of the optima; the set's own when None.
        folder: folder of what was played before.

    Raises:
        ValueError: no task is solved, a player of the user's own plays at none of the elbow counts, or a part of the
            evaluation, or more than it, is to be published.
    """
    if publish and drawn == EVALUATION:
        _check_whole(elbows, guests, planners, disturb)
    known = {key: figures for key, figures in optimal_figures(drawn, optima).items() if key[0] in elbows}
    if not known:
        path = optima or file_of(drawn)
        raise ValueError(f"{path} must hold an optimum for the elbows {list(elbows)}, got none; --solve finds them")
    lineup = contenders([count for count in elbows if any(key[0] == count for key in known)], guests, planners, trust)
    names = list(DISTURBANCES) if disturb else [NOMINAL]
    episodes = _episodes(drawn, lineup, names, list(known), machines, folder)
    found = scores(episodes, known)
    output = RESULTS if publish else output
    write_scores(found, output / f"{drawn.name}.csv")
    _write_episodes(episodes, output / f"{drawn.name}_episodes.csv")
    texts = {f"{drawn.name}.md": table(found, known), f"{drawn.name}_disturbed.md": disturbed_table(found)}
    for name, text in texts.items():
        if text:
            write_text(output / name, text)
        else:
            # An earlier run's would be of other episodes.
            (output / name).unlink(missing_ok=True)
    write_whole(output / f"{drawn.name}.png", partial(figure, found))
    if publish:
        publish_blocks(output)
    return "\n".join(text for text in texts.values() if text)


def _check_whole(elbows: Sequence[int], guests: Sequence[str], planners: bool, disturb: bool) -> None:
    """Raises ValueError unless this is what the README's tables show."""
    if not (planners and disturb and not guests and set(elbows) == set(ELBOW_NAMES)):
        given = f"elbows {list(elbows)}, planners {planners}, disturb {disturb}, players {list(guests)}"
        raise ValueError(
            f"--publish must be given with --planners and --disturb and without --with and --elbows, got {given}"
        )


def _episodes(
    drawn: TaskSet,
    lineup: Sequence[Contender],
    names: Sequence[str],
    keys: Sequence[Key],
    machines: Machines | None,
    folder: Path,
) -> Episodes:
    """Figures of everybody's episodes in some tasks of a set under some disturbances."""
    from tqdm import tqdm

    settings = [one.player().settings for one in lineup]
    compile_before((one, 1) for one in settings)
    jobs = {}
    for one in lineup:
        tasks = {number: drawn.numbered(one.elbows)[number] for elbows, number in keys if elbows == one.elbows}
        for name in names[:1] if one.slow else names:
            jobs[one, name] = Job(partial(played, one, tasks, name, folder), len(tasks), f"{one.name}, {name}")
    with tqdm(total=sum(job.size for job in jobs.values()), unit="episode", file=sys.stderr) as bar:
        return do_all(jobs, bar.update, machines)


def _write_episodes(episodes: Episodes, path: Path) -> None:
    """Writes a row for each episode."""
    header = [
        "elbows",
        "controller",
        "seed",
        "disturbance",
        "task",
        *(f"{name} [{unit}]" for name, unit in UNITS.items()),
    ]
    rows = [
        [
            one.elbows,
            one.name,
            "" if one.seed is None else one.seed,
            name,
            number,
            *(f"{figures[k]:.6g}" for k in UNITS),
        ]
        for (one, name), of in episodes.items()
        for number, figures in of.items()
    ]
    write_csv(path, header, rows)

"""Bound on the return: the best one that direct transcription finds for an environment, played in the simulator.

From each of several motions the simulator descends; the cheapest end is the guess of a program with two Radau points a
period, which is solved to the smallest smoothing and then again with three points. From a solved task nearby the
program starts at once, and a farther one is one of the motions. The cost that counts is the simulator's: of the planned
voltages open loop, and of the plan under the time-varying LQR.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from itertools import islice
from typing import TypeVar

from agents.control.trajectory import Trajectory
from agents.jobs.job import Job, Tell
from agents.jobs.machines import Machines, do_all
from agents.optimal.certificate import Bound, checked
from agents.optimal.descent import STAGES, Descended, Descent
from agents.optimal.guesses import posture_guesses, simulated
from agents.optimal.problem import Problem
from agents.optimal.solution import LOOSE, SMOOTHINGS, Point, Progress, Solution, SolveError, solve
from agents.optimal.store import Neighbour, Store
from agents.planning.collocation import Transcription
from agents.workers import compile_before
from elbow_gym.task.settings import Settings

Found = TypeVar("Found", Descended, Solution)

COARSE, FINE = 2, 3
"""Numbers of Radau points in a control period, in the search and in the refinement."""
THOROUGH = 2
"""Number of starts from which on every one is followed to a solution."""
FOLLOWED = 2
"""Most descents that are followed to a solution: the second where the first one's program does not converge."""
NEAR = 0.5
"""Distance up to which a task is solved from another one alone, with its multipliers. From farther ones solutions came
out to ten per cent dearer than from postures; there the neighbour is but one of the motions that are compared."""
NEIGHBOUR = "neighbour"
"""Name of the nearest solved task among the guesses."""
CONTINUED_BARRIER = 1e-4
"""Barrier that a solve from a task nearby starts with."""
CONTINUED_ITERATIONS = 40
"""Most iterations from a task nearby: near ones take five to fifteen; where far ones take more than this, the descent
is the shorter way."""


def descended(
    problem: Problem, guesses: Mapping[str, Trajectory], progress: Progress, machines: Machines | None = None
) -> tuple[dict[str, Descended], float]:
    """Ends of the first stage of the descents from all guesses by name, the cheapest first.

    Returns:
        The ends, and the CPU time that other processes took [s].

    Raises:
        SolveError: the simulator can follow no guess.
    """
    found, elsewhere = _of_each(problem, guesses, _descend, progress, machines)
    if not found:
        raise SolveError(f"the simulator must follow a guess, got none of {sorted(guesses)} that it can")
    return dict(sorted(found.items(), key=lambda item: item[1].cost)), elsewhere


def _descend(problem: Problem, guess: Trajectory, progress: Progress) -> Descended:
    end = Descent(problem)(guess, STAGES[:1])
    progress(f"descended to {end.cost:.5g}, {end.depth * 1e3:.2g} mm below the table")
    return end


def _follow(problem: Problem, guess: Trajectory, progress: Progress) -> Solution:
    """The solution with `COARSE` points from a guess or the end of its first stage."""
    further = Descent(problem)(guess, STAGES[1:] if guess.voltage.any() else STAGES)
    progress(f"descended to {further.cost:.5g}, {further.depth * 1e3:.2g} mm below the table")
    return solve(Transcription(problem, COARSE), further.trajectory, SMOOTHINGS, progress, tolerance=LOOSE)


def _of_each(
    problem: Problem,
    guesses: Mapping[str, Trajectory],
    way: Callable[[Problem, Trajectory, Progress], Found],
    progress: Progress,
    machines: Machines | None,
) -> tuple[dict[str, Found], float]:
    """Where a way leads from each guess, without those that fail, and the CPU time that other processes took [s]."""
    elsewhere = 0.0
    if machines is not None and len(guesses) > 1:
        jobs = {name: Job(partial(_apart, way, problem, guess), 1) for name, guess in guesses.items()}
        results = do_all(jobs, lambda _: None, machines)
        elsewhere = sum(seconds for *_, seconds in results.values())
        answers = {name: answer for name, (answer, _, _) in results.items()}
        for name, (_, said, _) in results.items():
            for line in said:
                progress(f"{name}: {line}")
    else:
        answers = {name: _tried(way, problem, guess, partial(_say, progress, name)) for name, guess in guesses.items()}
    found: dict[str, Found] = {}
    for name, answer in answers.items():
        if isinstance(answer, str):
            progress(f"{name}: {answer}")
        else:
            found[name] = answer
    return found, elsewhere


def _tried(
    way: Callable[[Problem, Trajectory, Progress], Found], problem: Problem, guess: Trajectory, progress: Progress
) -> Found | str:
    """Where a way leads from a guess, or why it leads nowhere."""
    try:
        return way(problem, guess, progress)
    except (ArithmeticError, ValueError) as error:
        return str(error)


def _apart(
    way: Callable[[Problem, Trajectory, Progress], Found], problem: Problem, guess: Trajectory, tell: Tell
) -> tuple[Found | str, list[str], float]:
    """`_tried` in a process of its own, with what it said and its CPU time [s]."""
    started, said = time.process_time(), list[str]()
    answer = _tried(way, problem, guess, said.append)
    tell(1)
    return answer, said, time.process_time() - started


def _say(progress: Progress, name: str, line: str) -> None:
    progress(f"{name}: {line}")


def refined(coarse: Transcription, solution: Solution, progress: Progress) -> tuple[Transcription, Solution]:
    """The program and the solution on the fine mesh, from variables and multipliers of the coarse one.

    Where that does not converge, from the coarse solution as the simulator plays it.

    Raises:
        SolveError: neither way converged.
    """
    program, point = Transcription(coarse.problem, FINE), solution.point
    if point.multipliers is None:
        raise ValueError("solution must have multipliers, got None")
    try:
        taken = program.taken_over(coarse, point.x, point.multipliers)
        return program, solve(program, Point(*taken), (solution.smoothing,), progress)
    except SolveError as error:
        progress(str(error))
        return program, solve(program, simulated(coarse.problem, solution.trajectory)[0], SMOOTHINGS, progress)


def certified(
    problem: Problem,
    guesses: Mapping[str, Trajectory],
    progress: Progress = lambda _: None,
    refine: bool = True,
    machines: Machines | None = None,
    thorough: bool = False,
) -> tuple[Bound, Solution]:
    """Solves a problem from several guesses, refines the best, plays it in the simulator and checks it.

    Args:
        problem: problem to solve.
        guesses: motions to start from, by name.
        progress: called with a line on every solve.
        refine: whether the mesh is refined; if not, the simulator's verdict alone is the check.
        machines: what follows every guess by itself; this process follows one after the other when None.
        thorough: whether every guess is followed to a solution, of which the cheapest is taken. Otherwise that goes for
            the guess alone with the cheapest descent, which need not lead to the cheapest solution.

    Returns:
        The bound, and the solution with `COARSE` points.

    Raises:
        SolveError: no guess converged, or a check failed, which is named.
    """
    took = _stopwatch()
    program = Transcription(problem, COARSE)
    if thorough:
        solutions, elsewhere = _of_each(problem, guesses, _follow, progress, machines)
        if not solutions:
            raise SolveError(f"a guess must lead to a solution, got none of {sorted(guesses)} that does")
        name, best = min(solutions.items(), key=lambda item: item[1].cost)
        return _finished(program, best, name, progress, refine, partial(took, elsewhere)), best
    ends, elsewhere = descended(problem, guesses, progress, machines)
    failures: list[str] = []
    for name, end in islice(ends.items(), FOLLOWED):
        followed = _tried(_follow, problem, end.trajectory, partial(_say, progress, name))
        if isinstance(followed, Solution):
            return _finished(program, followed, name, progress, refine, partial(took, elsewhere)), followed
        failures.append(f"{name}: {followed}")
        progress(failures[-1])
    raise SolveError(f"a guess must lead to a solution, got {'; '.join(failures)}")


def continued(problem: Problem, near: Neighbour, progress: Progress) -> tuple[Bound, Solution]:
    """Solves a problem from the solution of another one nearby; arguments, results and errors as in `certified`.

    From its variables and multipliers the program needs about twenty iterations; without them it descends first.
    """
    took, program, say = _stopwatch(), Transcription(problem, COARSE), partial(_say, progress, NEIGHBOUR)
    if near.point is None:
        followed = solve(program, Descent(problem)(near.trajectory, STAGES[1:]).trajectory, SMOOTHINGS, say)
    else:
        followed = solve(program, near.point, SMOOTHINGS, say, CONTINUED_ITERATIONS, CONTINUED_BARRIER, LOOSE)
    return _finished(program, followed, NEIGHBOUR, progress, True, took), followed


def _stopwatch() -> Callable[..., tuple[float, float]]:
    started, cpu = time.monotonic(), time.process_time()

    def took(elsewhere: float = 0.0) -> tuple[float, float]:
        return time.monotonic() - started, time.process_time() - cpu + elsewhere

    return took


def _finished(
    program: Transcription,
    coarse: Solution,
    name: str,
    progress: Progress,
    refine: bool,
    took: Callable[[], tuple[float, float]],
) -> Bound:
    """The bound that a solution with `COARSE` points leads to."""
    if refine:
        return checked(*refined(program, coarse, progress), coarse.cost, name, took)
    return checked(program, coarse, coarse.cost, name, took)


def bound(
    settings: Settings,
    *,
    above_table: bool | None = None,
    fresh: bool = False,
    starts: int = 2,
    machines: Machines | None = None,
    progress: Progress = lambda _: None,
    store: Store | None = None,
) -> Bound:
    """The best known solution of an environment's episode from its start without noise.

    A task that was solved before is taken from the store; one that is near to it is solved from there, any other from
    several postures and the nearest solved task, the shipped optima among them. It is a local optimum: better ones may
    exist. The start pose of `start="paper"` is the arm's nominal pose.

    Args:
        settings: arguments of the environment, without contact, friction, heat, supply resistance and randomisation.
        above_table: whether joints 3..n and the hand must have z >= 0; where there are fewer than two elbows if None.
        fresh: whether it is solved again, and from the postures; the cheaper solution stays in the store.
        starts: number of postures that a task from scratch is started from. Each is followed to a solution, and the
            cheapest is taken. With one, only the cheaper descent is followed, of its and the nearest solved task's.
        machines: what follows the postures side by side, such as `Machines()`, with which a script needs its
            `if __name__ == "__main__":`; this process follows one after the other when None.
        progress: called with a line on every solve.
        store: folder of the solved tasks; the checkout's own when None.

    Raises:
        ValueError: the settings have what the program does not know, which is named.
        SolveError: nothing converged, or a check failed, which is named.
    """
    problem = Problem(settings, len(settings.elbow_joints) < 2 if above_table is None else above_table)
    store = Store() if store is None else store
    stored = store.load(problem)
    known = None if stored is None else Bound.from_figures(*stored)
    if known is not None and not fresh:
        return known
    # The LQR finds its gains with a batch, and one arm plays it.
    compile_before([(settings, 1), settings])
    near = None if fresh else store.nearest(problem)
    guesses: dict[str, Trajectory] = {}
    found = None
    if near is not None:
        progress(f"nearest solved task: {near.name}, {near.distance:.2g} away")
        guesses[NEIGHBOUR] = near.trajectory
        if near.distance <= NEAR:
            try:
                found = continued(problem, near, progress)
            except ArithmeticError as error:
                progress(f"{NEIGHBOUR}: {error}")
    if found is None:
        guesses = {**posture_guesses(problem, starts), **guesses}
        found = certified(problem, guesses, progress, machines=machines, thorough=starts >= THOROUGH)
    answer, coarse = found
    if known is not None and known.cost <= answer.cost:
        return known
    store.save(problem, answer.figures, answer.optimum.trajectory, coarse.point)
    return answer

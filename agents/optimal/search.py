"""Bound on the return: the best one that direct transcription finds for an environment, played in the simulator.

Each of several postures gives a solution with two Radau points a period at a large smoothing; the cheapest is followed
to the smallest smoothing and then solved again with three points. A solved task nearby takes the postures' place. The
cost that counts is the simulator's: of the planned voltages open loop, and of the plan under the time-varying LQR.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial

from agents.control.trajectory import Trajectory
from agents.optimal.certificate import Bound, checked
from agents.optimal.collocation import Transcription
from agents.optimal.guesses import approach, posture_guesses, simulated
from agents.optimal.problem import Problem
from agents.optimal.solution import SMOOTHINGS, Point, Progress, Solution, SolveError, solve
from agents.optimal.store import Store
from agents.workers import Job, Tell, compile_before, in_processes
from elbow_gym.task.settings import Settings

COARSE, FINE = 2, 3
"""Numbers of Radau points in a control period, in the search and in the refinement."""
CONTINUED_BARRIER = 1e-4
"""Barrier that a solve from a task nearby starts with."""
CONTINUED_ITERATIONS = 80
"""Most iterations at one smoothing from a task nearby: near ones take five to fifteen; where far ones take more than
this, the postures are the shorter way."""


def best_solution(
    problem: Problem, guesses: Mapping[str, Trajectory], progress: Progress, parallel: bool = False
) -> tuple[str, Solution, float]:
    """The cheapest of the solutions from all guesses at the largest smoothing, with `COARSE` points.

    Returns:
        Its guess's name, the solution, and the CPU time that other processes took [s].

    Raises:
        SolveError: no guess led to a solution.
    """
    found: dict[str, Solution] = {}
    elsewhere = 0.0
    if parallel and len(guesses) > 1:
        # A rough solve has two smoothings, and one follows.
        jobs = {name: Job(partial(_search_apart, problem, guess), 3) for name, guess in guesses.items()}
        results = in_processes(jobs, lambda _: progress("a solve has ended"))
        elsewhere = sum(seconds for _, seconds in results.values())
        answers = {name: answer for name, (answer, _) in results.items()}
    else:
        answers = {name: _search(problem, guess, partial(_say, progress, name)) for name, guess in guesses.items()}
    for name, answer in answers.items():
        if isinstance(answer, Solution):
            found[name] = answer
        else:
            progress(f"{name}: {answer}")
    if not found:
        raise SolveError(f"a guess must lead to a solution, got none from {sorted(guesses)}")
    best = min(found, key=lambda name: found[name].cost)
    return best, found[best], elsewhere


def _say(progress: Progress, name: str, line: str) -> None:
    progress(f"{name}: {line}")


def _search(problem: Problem, guess: Trajectory, progress: Progress) -> Solution | str:
    """The solution from one guess, or what went wrong."""
    try:
        near = approach(Transcription(problem, 1), guess, progress)
        return solve(Transcription(problem, COARSE), near, SMOOTHINGS[:1], progress)
    except SolveError as error:
        return str(error)


def _search_apart(problem: Problem, guess: Trajectory, tell: Tell) -> tuple[Solution | str, float]:
    """`_search` in a process of its own, and its CPU time [s]."""
    started = time.process_time()
    return _search(problem, guess, lambda _: tell(1)), time.process_time() - started


def refined(problem: Problem, coarse: Solution, progress: Progress) -> tuple[Transcription, Solution]:
    """The program and the solution on the fine mesh, from variables and multipliers of the coarse one.

    Where that does not converge, from the coarse solution as the simulator plays it.

    Raises:
        SolveError: neither way converged.
    """
    program, point = Transcription(problem, FINE), coarse.point
    if point.multipliers is None:
        raise ValueError("coarse must have multipliers, got None")
    try:
        taken = program.taken_over(Transcription(problem, COARSE), point.x, point.multipliers)
        return program, solve(program, Point(*taken), (coarse.smoothing,), progress)
    except SolveError as error:
        progress(str(error))
        return program, solve(program, simulated(problem, coarse.trajectory)[0], SMOOTHINGS, progress)


def certified(
    problem: Problem,
    guesses: Mapping[str, Trajectory],
    progress: Progress = lambda _: None,
    refine: bool = True,
    parallel: bool = False,
) -> tuple[Bound, Solution]:
    """Solves a problem from several guesses, refines the best, plays it in the simulator and checks it.

    Args:
        problem: problem to solve.
        guesses: motions to start from, by name.
        progress: called with a line on every solve.
        refine: whether the mesh is refined; if not, the simulator's verdict alone is the check.
        parallel: whether every guess is followed in a process of its own.

    Returns:
        The bound, and the solution with `COARSE` points.

    Raises:
        SolveError: no guess converged, or a check failed, which is named.
    """
    took = _stopwatch()
    name, found, elsewhere = best_solution(problem, guesses, progress, parallel)
    took = partial(took, elsewhere)
    followed = solve(Transcription(problem, COARSE), found.point, SMOOTHINGS[1:], partial(_say, progress, name))
    return _finished(problem, followed, name, progress, refine, took), followed


def continued(problem: Problem, start: Point | Trajectory, name: str, progress: Progress) -> tuple[Bound, Solution]:
    """Solves a problem from the solution of another one nearby; arguments, results and errors as in `certified`."""
    took, program = _stopwatch(), Transcription(problem, COARSE)
    options = {"mu_init": CONTINUED_BARRIER} if isinstance(start, Point) else {}
    followed = solve(program, start, SMOOTHINGS, partial(_say, progress, name), CONTINUED_ITERATIONS, **options)
    return _finished(problem, followed, name, progress, True, took), followed


def _stopwatch() -> Callable[..., tuple[float, float]]:
    started, cpu = time.monotonic(), time.process_time()

    def took(elsewhere: float = 0.0) -> tuple[float, float]:
        return time.monotonic() - started, time.process_time() - cpu + elsewhere

    return took


def _finished(
    problem: Problem,
    coarse: Solution,
    name: str,
    progress: Progress,
    refine: bool,
    took: Callable[[], tuple[float, float]],
) -> Bound:
    """The bound that a solution with `COARSE` points leads to."""
    if refine:
        return checked(*refined(problem, coarse, progress), coarse.cost, name, took)
    return checked(Transcription(problem, COARSE), coarse, coarse.cost, name, took)


def bound(
    settings: Settings,
    *,
    above_table: bool | None = None,
    fresh: bool = False,
    parallel: bool = False,
    progress: Progress = lambda _: None,
    store: Store | None = None,
) -> Bound:
    """The best known solution of an environment's episode from its start without noise.

    A task that was solved before is taken from the store; one that is near to it is solved from there, any other from
    several postures. It is a local optimum: better ones may exist. The start pose of `start="paper"` is the arm's
    nominal pose.

    Args:
        settings: arguments of the environment, without contact, friction, heat, supply resistance and randomisation.
        above_table: whether joints 3..n and the hand must have z >= 0; where there are fewer than two elbows if None.
        fresh: whether it is solved again, and from the postures; the cheaper solution stays in the store.
        parallel: whether the postures are followed in processes of their own; a script then needs its
            `if __name__ == "__main__":`.
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
    found = None
    if near is not None:
        progress(f"nearest solved task: {near.name}, {near.distance:.2g} away")
        try:
            found = continued(problem, near.start, "neighbour", progress)
        except SolveError as error:
            progress(f"neighbour: {error}")
    if found is None:
        found = certified(problem, posture_guesses(problem), progress, parallel=parallel)
    answer, coarse = found
    if known is not None and known.cost <= answer.cost:
        return known
    store.save(problem, answer.figures, answer.optimum.trajectory, coarse.point)
    return answer

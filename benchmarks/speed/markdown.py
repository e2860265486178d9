"""Tables of the speed benchmark: all rows, those for a README, and work and precision."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from benchmarks.speed.environments import FRAME, START
from benchmarks.speed.own import ENV_STEP, EXPONENTIAL_STEP, OURS, PAPER_CASE, RK4_STEP
from benchmarks.speed.peers import C_LOOP, MUJOCO
from benchmarks.speed.precision import ERROR, Method, Point, best
from benchmarks.speed.rows import RATIO, Row, ratios

EQUAL_COST = "equal cost, not equal accuracy"
"""Note beside every comparison of a step with MuJoCo's RK4 step, which is of first order here."""
HEADER = (
    "who",
    "what",
    "unit",
    "joints",
    "elbows",
    "arms",
    "threads",
    "clock",
    "time",
    "quartiles",
    "per second",
    RATIO,
)


def duration(seconds: float) -> str:
    """A time with its unit, to three or four digits."""
    for scale, unit in ((1e6, "us"), (1e3, "ms")):
        if seconds * scale < 1000.0:
            return f"{seconds * scale:.3g} {unit}"
    return f"{seconds:.3g} s"


def shown(row: Row, ratio: float | None) -> tuple[str, ...]:
    """A row's cells under HEADER."""
    contender, (low, median, high) = row.contender, row.quartiles
    counts = (contender.joints, contender.elbows, contender.arms, contender.threads)
    return (
        contender.family,
        contender.name,
        contender.unit,
        *("-" if count is None else str(count) for count in counts),
        contender.clock,
        duration(median),
        f"{duration(low)} to {duration(high)}",
        "-" if contender.unit == START else f"{1.0 / median:,.0f}",
        "-" if ratio is None else f"{ratio:.3g}",
    )


def markdown(rows: Sequence[Row]) -> str:
    """The table of all rows, with a sentence on its last column."""
    table = _lines(HEADER, [shown(row, ratio) for row, ratio in zip(rows, ratios(rows), strict=True)])
    return f"{table}\nSteps are compared with MuJoCo's RK4 step: {EQUAL_COST}.\n"


BRIEF_HEADER = ("what", "unit", "arms", "CPU time", "per second", RATIO)


def brief(rows: Sequence[Row]) -> str:
    """The rows for a README: steps, environments, PPO and starting up in CPU time, the paper's arm with two elbows."""
    lines = []
    for row, ratio in zip(rows, ratios(rows), strict=True):
        who = row.contender
        own = who.family == OURS and who.unit in {EXPONENTIAL_STEP, RK4_STEP, ENV_STEP, START}
        peer = (who.family, who.name, who.unit) == (MUJOCO, C_LOOP, RK4_STEP)
        wanted = ((who.joints, who.elbows) == PAPER_CASE and (own or peer)) or who.unit in {FRAME, START}
        if wanted and who.clock == "cpu":
            _, what, unit, _, _, arms, _, _, time, _, per_second, shown_ratio = shown(row, ratio)
            name = f"{who.family}, {what}; {EQUAL_COST}" if peer else what
            lines.append((name, unit, arms, time, per_second, shown_ratio))
    return _lines(BRIEF_HEADER, lines)


PRECISION_HEADER = (
    "who",
    "integrator",
    "arms",
    "order of the state",
    "CPU time at a state error of 1e-4",
    RATIO,
    "CPU time at an energy error of 1e-4",
    RATIO,
)


def precision(chosen: Sequence[Method]) -> str:
    """Measured order, and CPU time of a simulated second of one arm at an error, by integrator."""
    errors: tuple[Callable[[Point], float], ...] = (lambda point: point.state_error, lambda point: point.energy_error)
    lines = []
    for method in chosen:
        cells = [method.family, method.integrator, str(method.arms), f"{method.order:.1f}"]
        for of in errors:
            time, peer = method.time_at(ERROR, of), best(chosen, ERROR, of)
            cells.append("-" if time is None else duration(time))
            cells.append("-" if time is None or peer is None else f"{peer / time:.3g}")
        lines.append(tuple(cells))
    return _lines(PRECISION_HEADER, lines)


def _lines(header: Sequence[str], body: Iterable[Sequence[str]]) -> str:
    return "".join(f"| {' | '.join(line)} |\n" for line in (header, ("---",) * len(header), *body))

"""Who takes part in the energy benchmark, in which part of it, and with what settings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from agents.control.controller import EFFORT, Controller
from agents.control.lqr import TimeVaryingLQR
from agents.control.trajectory import Trajectory
from agents.evaluation.metrics import REGIMES, Regime
from agents.evaluation.players import CLASSICAL, SHIFTED, policy_maker, settings_for
from agents.shipped.seeds import shipped_path, shipped_policies, shipped_seeds
from agents.tasks import POLICY_NAME
from benchmarks import optimal
from elbow_gym.baselines.pd import PAPER_KD, PAPER_KP, PDController
from elbow_gym.baselines.policy import read_policy
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

ELBOW_COUNTS = (2, 1, 0)
PARTS = {
    "nominal": "the default environment",
    "shifted": "wider starts, drawn circles and payloads that no training used",
    "table": "ElbowArmTable-v0: the table alone carries the arm",
}
"""Parts of the benchmark and what they are."""
GAINS = (0.25, 0.5, 2.0, 4.0)
"""By which both gains of the paper's PD are multiplied in the sweep beside it."""


@dataclass(frozen=True)
class Cell:
    """One controller in one part of the benchmark."""

    controller: str
    elbows: int
    part: str = "nominal"
    gain: float = 1.0
    """Of the PD's gains, times the paper's."""

    @property
    def regimes(self) -> tuple[Regime, ...]:
        """What is counted: on drawn circles no regime starts on the target, and of the sweep A is shown."""
        if self.gain != 1.0:
            return REGIMES[:1]
        return tuple(regime for regime in REGIMES if self.part != "shifted" or regime.start == "paper")

    def settings(self, arguments: dict[str, Any]) -> Settings:
        """The part's environment with a controller's own arguments."""
        if self.part == "table":
            return settings_for(arguments, "ElbowArmTable-v0")
        settings = Settings(elbows=self.elbows, **arguments)
        return replace(settings, **SHIFTED) if self.part == "shifted" else settings


@dataclass(frozen=True)
class Contender:
    """What plays a cell: a controller, or one training seed of a learned one."""

    settings: Settings
    make: Callable[[ElbowArmVectorEnv], Controller]
    identity: str
    """What it is made of, beyond the code; results are taken over only where it is the same."""
    effort: float = 1.0
    """Of a control period, times the PD's."""
    seed: int | None = None
    """Of the training."""

    @property
    def work(self) -> int:
        """What an episode takes, in control periods of the PD."""
        return round(self.effort * self.settings.horizon)


def learned() -> dict[Cell, str]:
    """The learned cells, and the names of the policies that are shipped for them."""
    found: dict[Cell, str] = {}
    for name in sorted({policy.rpartition("_seed")[0] for policy in shipped_policies()}):
        parts = POLICY_NAME.fullmatch(name)
        if parts is None:
            continue
        controller, task = parts["controller"], parts["task"]
        if task == "table":
            found[Cell(controller, 0, "table")] = name
        elif task == "random":
            found[Cell(f"{controller}_random", 2)] = name
        else:
            found[Cell(controller, int(task.removeprefix("elbows")))] = name
    shifted = {replace(cell, part="shifted"): name for cell, name in found.items() if cell.part == "nominal"}
    return {**found, **shifted}


def cells() -> list[Cell]:
    """Every comparison: the classical controllers, and what a file is there for; part by part."""
    classical = ["pd_24v" if name == "pd" else name for name in CLASSICAL]
    starts = {regime.start for regime in REGIMES}
    policies = sorted(learned(), key=lambda cell: (cell.controller, -cell.elbows))
    result = [Cell(name, elbows) for name in classical for elbows in ELBOW_COUNTS]
    result += [
        Cell("lqr", elbows)
        for elbows in ELBOW_COUNTS
        if all(optimal.files(optimal.Cell(elbows, start))[1].is_file() for start in starts)
    ]
    result += [cell for cell in policies if cell.part == "nominal"]
    # The LQR's trajectory is of one circle, and the 10 kHz PD has a supply that the others have not.
    result += [replace(cell, part="shifted") for cell in result if cell.controller not in ("lqr", "pd_paper")]
    tabletop = [cell for cell in policies if cell.part == "table"]
    if tabletop:
        result += [Cell(name, 0, "table") for name in classical if name != "pd_paper"] + tabletop
    return result


def sweep() -> list[Cell]:
    """The paper's PD at 24 V with other gains, for the Pareto figure."""
    return [Cell("pd_24v", elbows, gain=gain) for elbows in ELBOW_COUNTS for gain in GAINS]


def contenders(cell: Cell) -> list[Contender]:
    """What plays a cell: one contender, or one per training seed."""
    if cell.controller == "lqr":
        return [_lqr(cell)]
    arguments, make = CLASSICAL.get({"pd_24v": "pd"}.get(cell.controller, cell.controller), ({}, None))
    if cell.gain != 1.0:
        make = partial(PDController, kp=cell.gain * PAPER_KP, kd=cell.gain * PAPER_KD)
    if make is not None:
        effort = EFFORT.get(cell.controller, 1.0)
        return [Contender(cell.settings(arguments), make, f"{cell.controller} x {cell.gain:g}", effort)]
    name = learned()[cell]
    policies = [(seed, read_policy(shipped_path(name, seed))) for seed in shipped_seeds(name)]
    return [
        Contender(cell.settings({}), policy_maker(policy), policy.card.digest, seed=seed) for seed, policy in policies
    ]


def starts(cell: Cell) -> set[str]:
    """The environment's starts that a cell's regimes have; each is one run."""
    return {regime.start for regime in cell.regimes}


def work(cell: Cell) -> int:
    """What a cell takes, in control periods of the PD."""
    return len(starts(cell)) * sum(player.work for player in contenders(cell))


def _lqr(cell: Cell) -> Contender:
    paths = {regime.start: optimal.files(optimal.Cell(cell.elbows, regime.start))[1] for regime in REGIMES}

    def follow(env: ElbowArmVectorEnv) -> TimeVaryingLQR:
        return TimeVaryingLQR(env, Trajectory.load(paths[env.settings.start]))

    identity = _digest([path.read_bytes() for path in paths.values()])
    return Contender(cell.settings({}), follow, identity, EFFORT["lqr"])


def _digest(contents: Sequence[bytes]) -> str:
    import hashlib

    return hashlib.sha256(b"".join(contents)).hexdigest()

"""Who appears in the report: the benchmark's controllers at every elbow count, each from both starts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from agents.control.controller import EFFORT, Controller
from agents.control.lqr import TimeVaryingLQR
from agents.control.trajectory import Trajectory
from agents.evaluation.players import CLASSICAL, named_controller
from agents.paper.figures import CASES
from agents.shipped import OPTIMA
from agents.shipped.seeds import shipped_policies
from agents.tasks import POLICY_NAME
from elbow_gym.task.settings import STARTS, Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

SHOWN_AS = {"pd": "pd_24v"}
"""Names in the benchmark's tables where they differ from the command line's."""
TABLE = "table"
"""Name of the compliant table where others have their number of elbows."""


@dataclass(frozen=True)
class Entry:
    """A controller in one environment; its runs from all starts are one job."""

    name: str
    """As `agents.evaluation.players.named_controller` knows it, or "lqr"."""
    elbows: int
    """On the rigid table."""
    env: str = "ElbowArm-v0"
    """Id of the environment that a learned one was trained in; on the compliant table, where all play."""

    @property
    def controller(self) -> str:
        """Its name in the benchmark's tables and in `agents.style`."""
        suffix = "_random" if self.env == "ElbowArmRandom-v0" else ""
        return SHOWN_AS.get(self.name, self.name) + suffix

    @property
    def bearing(self) -> str:
        """What the arm leans on: its number of elbows, or `TABLE`."""
        return TABLE if self.env == "ElbowArmTable-v0" else str(self.elbows)

    @cached_property
    def size(self) -> int:
        """Work to be done, all episodes together, in control periods of the PD."""
        return round(EFFORT.get(self.name, 1.0) * self.contender()[0].horizon) * len(STARTS)

    def contender(self) -> tuple[Settings, Callable[[ElbowArmVectorEnv], Controller]]:
        """The environment and the maker of the controller."""
        if self.name == "lqr":

            def follow(env: ElbowArmVectorEnv) -> Controller:
                return TimeVaryingLQR(env, Trajectory.load(trajectory(self.elbows, env.settings.start)))

            return Settings(elbows=self.elbows), follow
        settings, make = named_controller(self.name, self.elbows, self.env)
        # Who was trained on drawn arms and circles is shown with the paper's.
        return (Settings(elbows=self.elbows) if self.env == "ElbowArmRandom-v0" else settings), make


def trajectory(elbows: int, start: str) -> Path:
    """Where `python -m benchmarks optimal` leaves the optimal trajectory of the default reward."""
    return OPTIMA / f"elbows{elbows}{'_on_target' if start == 'on_target' else ''}.npz"


def roster() -> list[Entry]:
    """The classical controllers, and the LQR and the learned policies as far as their files are there.

    Where a policy for the compliant table is shipped, the classical ones but the 10 kHz PD play on it too.
    """
    entries = [Entry(name, elbows) for name in CLASSICAL for elbows in CASES]
    entries += [
        Entry("lqr", elbows) for elbows in CASES if all(trajectory(elbows, start).is_file() for start in STARTS)
    ]
    learned, tabletop = [], []
    # Several seeds make one entry, which plays the best.
    names = {policy.rpartition("_seed")[0] for policy in shipped_policies()}
    for found in filter(None, map(POLICY_NAME.fullmatch, names)):
        name, task = found.group("controller", "task")
        if task == "table":
            tabletop.append(Entry(name, 0, "ElbowArmTable-v0"))
        elif task == "random":
            learned.append(Entry(name, 2, "ElbowArmRandom-v0"))
        else:
            learned.append(Entry(name, int(task.removeprefix("elbows"))))
    entries += sorted(learned, key=lambda entry: (entry.controller, -entry.elbows))
    if tabletop:
        entries += [Entry(name, 0, "ElbowArmTable-v0") for name in CLASSICAL if name != "pd_paper"]
        entries += sorted(tabletop, key=lambda entry: entry.controller)
    return entries

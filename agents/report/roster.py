"""Who appears in the report: the benchmark's controllers at every elbow count, each from both starts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from agents.controller import Controller
from agents.evaluate import CLASSICAL, named_controller
from agents.figures import CASES
from agents.lqr import TimeVaryingLQR
from agents.policy import shipped_policies
from agents.trajectory import Trajectory
from elbow_gym.settings import STARTS, Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

SHOWN_AS = {"pd": "pd_24v"}
"""Names in the benchmark's tables where they differ from the command line's."""
LEARNED = ("ppo", "sac")
# What a control period costs beside the others' [1], for an honest time left.
EFFORT = {"pd_gravity": 2.5, "pd_smooth": 2.0, "computed_torque": 3.0, "computed_torque_posture": 15.0}


@dataclass(frozen=True)
class Entry:
    """A controller at one elbow count; its runs from all starts are one job."""

    name: str
    """As `agents.evaluate.named_controller` knows it, or "lqr"."""
    elbows: int
    results: Path
    """Folder of the benchmark's results."""

    @property
    def controller(self) -> str:
        """Its name in the benchmark's tables and in `agents.style`."""
        return SHOWN_AS.get(self.name, self.name)

    @property
    def size(self) -> int:
        """Work to be done, in control periods of the PD."""
        horizon = 250 if self.name not in CLASSICAL else Settings(**CLASSICAL[self.name][0]).horizon
        return round(EFFORT.get(self.name, 1.0) * horizon * len(STARTS))

    def contender(self) -> tuple[Settings, Callable[[ElbowArmVectorEnv], Controller]]:
        """The environment and the maker of the controller."""
        if self.name != "lqr":
            return named_controller(self.name, self.elbows)

        def follow(env: ElbowArmVectorEnv) -> Controller:
            return TimeVaryingLQR(env, Trajectory.load(trajectory(self.results, self.elbows, env.settings.start)))

        return Settings(elbows=self.elbows), follow


def trajectory(results: Path, elbows: int, start: str) -> Path:
    """Where `python -m benchmarks optimal` leaves the optimal trajectory of the default reward."""
    return results / "optimal" / f"elbows{elbows}{'_on_target' if start == 'on_target' else ''}.npz"


def roster(results: Path) -> list[Entry]:
    """The classical controllers, and the LQR and the learned policies as far as their files are there."""
    entries = [Entry(name, elbows, results) for name in CLASSICAL for elbows in CASES]
    entries += [
        Entry("lqr", elbows, results)
        for elbows in CASES
        if all(trajectory(results, elbows, start).is_file() for start in STARTS)
    ]
    shipped = shipped_policies()
    entries += [
        Entry(name, elbows, results)
        for name in LEARNED
        for elbows in CASES
        if any(policy.startswith(f"{name}_elbows{elbows}") for policy in shipped)
    ]
    return entries

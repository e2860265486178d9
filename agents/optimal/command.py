"""Command `python -m agents bound`: the settings that its options mean, and the lines it prints."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from agents.optimal.certificate import Bound
from agents.optimal.search import bound
from elbow_gym.parameters import as_arm
from elbow_gym.task.settings import Settings

SOLVES = 12
"""Solves that a task takes from scratch, for the bar."""


def settings_of(
    elbows: Sequence[int], weights: tuple[float, float], pose: Sequence[float] | None, more: Mapping[str, Any]
) -> Settings:
    """`Settings` without start noise.

    Args:
        elbows: one number of elbows up to 2, or joint numbers.
        weights: of the tracking [1/m] and of the energy [1/W].
        pose: start pose [rad], (n,); the arm's nominal pose when None.
        more: further arguments of the environment.
    """
    bearing = int(elbows[0]) if len(elbows) == 1 and elbows[0] <= 2 else tuple(elbows)
    chosen = {"elbows": bearing, "tracking_weight": weights[0], "energy_weight": weights[1], "start_noise": 0.0, **more}
    if pose is not None:
        chosen["arm"] = replace(as_arm(chosen.get("arm", "paper")), nominal_pose=tuple(pose))
    return Settings(**chosen)


def solve_and_print(settings: Settings, above_table: bool | None, fresh: bool, output: Path | None) -> None:
    """Finds a bound with a bar on stderr and prints it; `output` is the file for its trajectory, .npz."""
    from tqdm import tqdm

    with tqdm(total=SOLVES, unit="solve", file=sys.stderr) as bar:

        def advance(line: str) -> None:
            bar.set_description(line[:60])
            bar.update()

        found = bound(settings, above_table=above_table, fresh=fresh, parallel=True, progress=advance)
        bar.total = bar.n
    for line in lines(found):
        print(line)
    if output is not None:
        found.optimum.trajectory.save(output)
        print(output)


def lines(found: Bound) -> list[str]:
    """A bound and its certificate for a reader."""
    optimum, certificate = found.optimum, found.certificate
    return [
        f"return                {-found.cost:.6g} (simulator, under the LQR)",
        f"electrical energy     {optimum.energy:.4g} J",
        f"tracking error        {optimum.error_rms:.3g} mm (root mean square from 2 s on)",
        f"predicted return      {-optimum.predicted_cost:.6g}, {certificate.replay_error:.2g} of it apart",
        f"mesh change           {certificate.mesh_change:.2g} of the cost",
        f"Lagrangian's gradient {certificate.stationarity:.2g}, conditions met to {certificate.violation:.2g}",
        f"smoothing             {1e3 * certificate.smoothing:g} mm",
        f"from                  {optimum.guess}, {found.cpu_seconds:.3g} s of CPU time",
    ]

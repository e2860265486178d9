"""One row of the energy benchmark."""

from __future__ import annotations

from dataclasses import dataclass

from agents.evaluation.interquartile import Estimate


@dataclass(frozen=True)
class Row:
    """One controller at one elbow count in one regime of a part of the benchmark."""

    controller: str
    elbows: int
    regime: str
    figures: dict[str, Estimate]
    joint_energy: tuple[float, ...]
    """Interquartile mean of each joint's signed electrical energy [J]."""
    part: str = "nominal"
    gain: float = 1.0
    """Factor on both gains of the paper's PD [-]."""
    seeds: tuple[dict[str, float], ...] = ()
    """Training seeds of a learned controller, each with its interquartile means over the episodes."""
    gap: float | None = None
    """The optimality gap (J - J_opt) / |J_opt| with J = -return; None where no bound was sought."""

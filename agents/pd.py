"""PD controller of the paper, from `elbow_gym.baselines.pd`."""

from __future__ import annotations

from elbow_gym.baselines.pd import PDController

__all__ = ["PDController"]

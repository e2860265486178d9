"""Time that a controller takes for a decision."""

from __future__ import annotations

import time

import numpy as np

from agents.evaluation.player import Player
from elbow_gym.vector_env import ElbowArmVectorEnv

DECISIONS = 200
"""Number of decisions that are timed."""
FIRST = 20
"""Number of decisions before them, in which caches fill."""


def decision_time(player: Player) -> float:
    """Median CPU time of a controller's `predict` for one arm [s], over the first decisions of an episode.

    The thread's time counts, so that other programs on the machine do not.

    Args:
        player: the player.
    """
    from threadpoolctl import threadpool_limits

    env = ElbowArmVectorEnv(1, **player.settings.arguments, autoreset_mode="Disabled")
    observation, _ = env.reset(seed=[0])
    taken = []
    # What threads of BLAS do besides would not be counted.
    with threadpool_limits(1):
        controller = player.make(env)
        for _ in range(min(FIRST + DECISIONS, player.settings.horizon)):
            before = time.thread_time()
            action, _ = controller.predict(observation, deterministic=True)
            taken.append(time.thread_time() - before)
            observation = env.step(action)[0]
    return float(np.median(taken[FIRST:] or taken))

"""Branches of an arm's state on the batch kernel: what each of many plans would cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.planning.planner import View
from agents.planning.tail import Tail
from elbow_gym.env import ElbowArmEnv
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

Array = NDArray[np.float64]


class Branches:
    """Environments for the branches of one arm's state.

    Args:
        settings: arguments of the environment, whose circle is not used.
        tail: cost behind a plan.
        action: actions from voltages [V].
        sizes: numbers of plans that `costs` will be asked for.
    """

    def __init__(
        self, settings: Settings, tail: Tail, action: Callable[[Array], NDArray[np.float32]], sizes: tuple[int, ...]
    ) -> None:
        self._settings, self._tail, self._action = settings, tail, action
        self._root = ElbowArmEnv(**settings.arguments)
        self._root.reset(seed=0)
        self._batches = {
            size: ElbowArmVectorEnv(size, **settings.arguments, autoreset_mode="Disabled") for size in sizes
        }

    def costs(self, view: View, plans: Array) -> Array:
        """Negative returns of plans from a view's state, the tail included, (S,).

        Args:
            view: state and motion equations of the arm, and its targets.
            plans: voltages [V], (S, N, n), S being one of the sizes.
        """
        options: dict[str, Any] = {"state": view.state, "phase": view.angle}
        if view.inverse.payload > 0.0:
            options["parameters"] = {"payload": view.inverse.payload}
        self._root.reset(options=options)
        batch, periods = self._batches[len(plans)], plans.shape[1]
        batch.set_state(self._root.get_state(), arms=np.arange(len(plans)))
        tracking, energy = self._settings.tracking_weight, self._settings.energy_weight
        simulator, cost = batch.episodes.simulator, np.zeros(len(plans))
        for actions, target in zip(np.moveaxis(self._action(plans), 1, 0), view.target, strict=False):
            info = batch.step(actions)[4]
            # Targets are the view's, since a drawn circle is no setting.
            error = np.linalg.norm(simulator.hand_position - target, axis=-1)
            cost += tracking * error - info["reward_energy"]
        last = view.target[periods - 1], view.velocity[periods - 1]
        return cost + replace(self._tail, inverse=view.inverse).cost(
            simulator.q, simulator.q_dot, *last, tracking, energy
        )

"""Network that is fitted to a teacher's laws on the states that it visits, each error at what it costs."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.learning.newton.settings import NewtonSettings

LOWEST_RATE = 0.02
"""Share of its start that the learning rate ends at [-]."""
LINEAR = 0.05
"""Cost of an action's error above which the loss grows with its root [-], so that strays do not rule the fit."""
LEAST_SPREAD = 0.01
"""Least standard deviation that an entry of the observation is divided by [-]."""
LONGEST = 1.0
"""Largest norm of a gradient; longer ones are scaled down to it."""
BEYOND = 0.01
"""Share of an error that counts where both label and network are beyond the supply voltage [-]."""


class Labels(NamedTuple):
    """What the teacher does in visited states."""

    observation: NDArray[np.float32]
    """Observations, (samples, size)."""
    action: NDArray[np.float32]
    """Teacher's actions, in units of the supply voltage and not clipped to it, (samples, n)."""
    effort: NDArray[np.float32]
    """Second derivative of the cost in the actions, (samples, n, n)."""


class Student:
    """Network and its running average, with the optimiser; it observes by mean and spread of the first labels.

    Args:
        sizes: numbers of units in the layers, from the observation to the action.
        how: settings.
        seed: seed of the weights.
    """

    def __init__(self, sizes: tuple[int, ...], how: NewtonSettings, seed: int) -> None:
        import torch

        torch.manual_seed(seed)
        self.sizes, self._how = sizes, how
        layers: list[Any] = []
        for size, after in pairwise(sizes):
            layers += [torch.nn.Linear(size, after), torch.nn.SiLU()]
        self._network = torch.nn.Sequential(*layers[:-1])
        self._average = [weights.detach().clone() for weights in self._network.parameters()]
        self._mean, self._spread = torch.zeros(sizes[0]), torch.ones(sizes[0])
        self._optimiser = torch.optim.Adam(self._network.parameters(), fused=True)

    def observe(self, labels: Labels) -> None:
        """Takes mean and spread of the observations for the first layer's."""
        import torch

        seen = labels.observation
        self._mean = torch.from_numpy(seen.mean(axis=0))
        self._spread = torch.from_numpy(np.maximum(seen.std(axis=0), LEAST_SPREAD).astype(np.float32))

    def fit(self, window: list[Labels], steps: int, done: tuple[float, float], rng: np.random.Generator) -> float:
        """Makes gradient steps on labels.

        Args:
            window: labels of several rounds.
            steps: number of gradient steps.
            done: shares of the training that are done at the first and after the last of them [-].
            rng: generator of the batches.

        Returns:
            Mean cost of the errors in a control period, to second order [-].
        """
        import torch

        seen, action, effort = (torch.from_numpy(np.concatenate(part)) for part in zip(*window, strict=True))
        scaled, total = (seen - self._mean) / self._spread, 0.0
        for j in range(steps):
            share = done[0] + (done[1] - done[0]) * j / steps
            for group in self._optimiser.param_groups:
                group["lr"] = self._how.learning_rate * max(LOWEST_RATE, 0.5 * (1.0 + math.cos(math.pi * share)))
            chosen = torch.from_numpy(rng.integers(len(seen), size=self._how.batch_size))
            label, own = action[chosen], self._network(scaled[chosen])
            error = own - label.clamp(-1.0, 1.0)
            beyond = ((label >= 1.0) & (own > 1.0)) | ((label <= -1.0) & (own < -1.0))
            error = torch.where(beyond, BEYOND * error, error)
            cost = 0.5 * torch.einsum("bi,bij,bj->b", error, effort[chosen], error)
            loss = 2.0 * LINEAR * (torch.sqrt(1.0 + cost / LINEAR) - 1.0).mean()
            self._optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self._network.parameters(), LONGEST)
            self._optimiser.step()
            total += float(cost.detach().mean())
            with torch.no_grad():
                for mean, weights in zip(self._average, self._network.parameters(), strict=True):
                    mean.lerp_(weights, self._how.averaging)
        return total / steps

    def settle(self) -> None:
        """Sets the average to the present weights, while they still move far."""
        self._average = [weights.detach().clone() for weights in self._network.parameters()]

    def weights(self) -> dict[str, NDArray[np.float32]]:
        """Averaged weights by a policy's names, for plain observations."""
        arrays = [mean.numpy().copy() for mean in self._average]
        mean, spread = self._mean.numpy(), self._spread.numpy()
        arrays[0] = arrays[0] / spread
        arrays[1] = arrays[1] - arrays[0] @ mean
        names = [f"{kind}_{k}" for k in range(len(self.sizes) - 1) for kind in ("weight", "bias")]
        return dict(zip(names, arrays, strict=True))

    def state(self) -> dict[str, Any]:
        """Everything that `restore` needs."""
        return {
            "network": self._network.state_dict(),
            "average": self._average,
            "observed": (self._mean, self._spread),
            "optimiser": self._optimiser.state_dict(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Takes over the `state` of a student of the same sizes."""
        self._network.load_state_dict(state["network"])
        self._average = list(state["average"])
        self._mean, self._spread = state["observed"]
        self._optimiser.load_state_dict(state["optimiser"])

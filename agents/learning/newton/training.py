"""Rounds of playing, improving and fitting: the policy plays drawn tasks, a teacher improves its motions, it follows.

The teacher starts from what the policy does, so that its answers to all tasks are of one kind: optima that are found
one by one come from several kinds of motion, between which a network would have to choose.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.lqr import states_of
from agents.learning.newton.settings import NewtonSettings
from agents.learning.newton.student import Labels, Student
from agents.learning.newton.teacher import Improved, Motions, Tasks, Teacher
from agents.planning.task import check_modelled
from elbow_gym.baselines.policy import Policy
from elbow_gym.baselines.policy_card import PolicyCard
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

Array = NDArray[np.float64]
Act = Callable[[int, NDArray[np.float32], Array], Array]
"""Actions (B, n) in a control period by its number, the observations and the states (q, q_dot, current), (B, 3n)."""

FEWEST = 5
"""Rounds whose labels are kept at the start, where half of them would be fewer."""
STRAYS = 1.5
"""Largest labelled action, in units of the supply voltage."""
HOPELESS = 2.0
"""Multiple of the tasks' median cost above which an improved motion teaches nothing: an arm that has fallen, say."""
LED = 2
"""Factor of the gradient steps after a round in which the initial policy drives."""


class Training:
    """A training that is made round by round.

    Args:
        settings: settings of the environment, JSON types only.
        how: settings of the training.
        seed: seed of the network, the tasks, the noise and the batches.
        initial: policy that drives in the first rounds. It may know the first entries of the observation alone, as a
            policy does whose task was not observed.

    Raises:
        ValueError: the environment has what the teacher does not know, which is named, or the policy is not for it.
    """

    def __init__(self, settings: Settings, how: NewtonSettings, seed: int, initial: Policy) -> None:
        check_modelled(settings)
        if settings.action_unit != "fraction":
            raise ValueError(f"action_unit must be 'fraction' in this training, got {settings.action_unit!r}")
        self._settings, self._how, self._initial = settings, how, initial
        self._one = ElbowArmVectorEnv(how.num_envs, **settings.arguments, autoreset_mode="Disabled")
        self._two = ElbowArmVectorEnv(2 * how.num_envs, **settings.arguments, autoreset_mode="Disabled")
        names, known = self._one.observation_names, initial.card.observation
        if names[: len(known)] != known:
            raise ValueError(f"initial policy must observe the environment's first entries, got {known}")
        self._watched = len(known)
        self._teacher = Teacher(settings, how.num_envs, len(settings.elbow_joints) < 2)
        sizes = (len(names), *how.hidden, settings.parsed_arm.n_joints)
        self._student, self._rng = Student(sizes, how, seed), np.random.default_rng(seed)
        self._window: list[Labels] = []
        self._price, self.rounds = how.first_price, 0

    @property
    def steps(self) -> int:
        """Control periods that the policy and the teacher have played so far, all arms together."""
        return self.rounds * 3 * self._how.num_envs * self._settings.horizon

    def round(self) -> dict[str, float]:
        """Makes a round.

        Returns:
            Means over its tasks: the policy's return and the teacher's under noise, the policy's cost and that of the
            improved motions, smoothed both; the share of tasks whose labels are kept [-], the price of the next round
            [1/rad^2], and the cost of the fit's errors in an episode.
        """
        how, led = self._how, self.rounds < self._how.led_rounds
        smoothing = how.smoothing_at(self.rounds / how.rounds)
        drive = self._led if led else self.policy({"command": ""}).predict
        seeds = self._rng.integers(2**31, size=how.num_envs).tolist()
        first, _ = self._one.reset(seed=seeds)
        tasks = Tasks.of(self._one, first)
        seen, motions, reward = played(self._one, first, lambda k, observed, states: drive(observed)[0])
        price, before, found = np.full(how.num_envs, self._price), np.zeros(how.num_envs), None
        better = motions
        for k in range(how.newton_steps):
            found = self._teacher.improve(tasks, better, price, smoothing)
            better, price = found.motions, found.price
            before = found.before if k == 0 else before
        assert found is not None  # newton_steps is at least one
        self._price = float(np.exp(np.log(price).mean()))
        again, more, rewards = self._noisy(seeds, drive, found)
        visited = (motions.states, *np.split(more.states, 2))
        kept = np.tile(found.after <= HOPELESS * np.median(found.after), len(visited))
        observed = np.concatenate([seen, again])[kept]
        action = np.concatenate([self._taught(found, slice(None), states[:, :-1]) for states in visited])[kept]
        effort = np.tile(found.law.effort, (len(visited), 1, 1, 1))[kept] * self._settings.voltage_limit**2
        self._window.append(
            Labels(
                observed.reshape(-1, observed.shape[-1]),
                np.clip(action, -STRAYS, STRAYS).reshape(-1, action.shape[-1]).astype(np.float32),
                effort.reshape(-1, *effort.shape[-2:]).astype(np.float32),
            )
        )
        if self.rounds == 0:
            self._student.observe(self._window[0])
        self._window = self._window[-max(FEWEST, min(how.most_rounds, (self.rounds + 2) // 2)) :]
        done = self.rounds / how.rounds, (self.rounds + 1) / how.rounds
        error = self._student.fit(self._window, how.gradient_steps * (LED if led else 1), done, self._rng)
        if led:
            self._student.settle()
        self.rounds += 1
        return {
            "return": float(reward.mean()),
            "kept": float(kept.mean()),
            "taught_return": float(rewards[how.num_envs :].mean()),
            "cost": float(before.mean()),
            "improved_cost": float(found.after.mean()),
            "price": self._price,
            "fit": error * self._settings.horizon,
        }

    def _led(self, observed: NDArray[np.float32]) -> tuple[NDArray[np.float32], None]:
        return self._initial.predict(observed[:, : self._watched])

    def _noisy(self, seeds: list[int], drive: Any, found: Improved) -> tuple[NDArray[np.float32], Motions, Array]:
        """`played` of the same tasks under the policy with noise, and then under the teacher with noise."""
        how, arms, rng = self._how, self._how.num_envs, self._rng
        noise = np.concatenate([how.policy_noise * rng.random(arms), np.full(arms, how.teacher_noise)])

        def act(k: int, observed: NDArray[np.float32], states: Array) -> Array:
            taught = self._taught(found, slice(k, k + 1), states[arms:, None])[:, 0]
            both = np.concatenate([drive(observed[:arms])[0], np.clip(taught, -1.0, 1.0)])
            return both + noise[:, None] * rng.standard_normal(both.shape)

        first, _ = self._two.reset(seed=seeds + seeds)
        return played(self._two, first, act)

    def _taught(self, found: Improved, periods: slice, states: Array) -> Array:
        """Teacher's actions, (B, k, n), in states (B, k, 3n) of some periods, around the improved motions."""
        apart = states - found.motions.states[:, :-1][:, periods]
        law = (found.law.gains[:, periods] @ apart[..., None])[..., 0]
        return (found.motions.voltage[:, periods] - law) / self._settings.voltage_limit

    def policy(self, card: dict[str, Any]) -> Policy:
        """The averaged network as a policy.

        Args:
            card: further fields of the policy's card.
        """
        whole = PolicyCard(
            algorithm="newton",
            environment=self._settings.arguments,
            observation=self._one.observation_names,
            layers=self._student.sizes,
            activation="silu",
            **card,
        )
        return Policy(whole, self._student.weights())

    def state(self) -> dict[str, Any]:
        """What `restore` needs: all but the labels so far, which the next rounds make anew."""
        rng = self._rng.bit_generator.state
        return {"student": self._student.state(), "rounds": self.rounds, "price": self._price, "rng": rng}

    def restore(self, state: dict[str, Any]) -> None:
        """Takes over the `state` of a training with the same settings."""
        self._student.restore(state["student"])
        self.rounds, self._price = state["rounds"], state["price"]
        self._rng.bit_generator.state = state["rng"]


def played(
    env: ElbowArmVectorEnv, observation: NDArray[np.float32], act: Act
) -> tuple[NDArray[np.float32], Motions, Array]:
    """One episode of every arm from its reset: observations (B, N, size), motions, and returns (B,).

    Args:
        env: environment whose actions are shares of the supply voltage.
        observation: first observations.
        act: actions.
    """
    episodes = env.episodes
    periods, n = episodes.horizon, episodes.arm.n_joints
    seen = np.empty((env.num_envs, periods, observation.shape[-1]), dtype=np.float32)
    states, voltage = np.empty((env.num_envs, periods + 1, 3 * n)), np.empty((env.num_envs, periods, n))
    total = np.zeros(env.num_envs)
    states[:, 0] = states_of(episodes.simulator)
    for k in range(periods):
        action = np.clip(act(k, observation, states[:, k]), -1.0, 1.0).astype(np.float32)
        seen[:, k], voltage[:, k] = observation, action * episodes.volts_per_action
        observation, reward, *_ = env.step(action)
        states[:, k + 1] = states_of(episodes.simulator)
        total += reward
    return seen, Motions(states, voltage), total

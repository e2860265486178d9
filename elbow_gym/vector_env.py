"""Gymnasium vector environment of B arms in one compiled call."""

from __future__ import annotations

import itertools
import numbers
import operator
from collections.abc import Mapping, Sequence
from typing import Any, cast

import gymnasium as gym
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from elbow_gym.checks import as_dict, as_numbers, one_of, positive_integer
from elbow_gym.env import ElbowArmEnv, action_space, observation_space
from elbow_gym.parameters import ArmParameters
from elbow_gym.rendering.viewer import Viewer
from elbow_gym.simulation.writable import take_over
from elbow_gym.task.arm_access import ask, assign
from elbow_gym.task.attributes import TaskAttributes, check_arguments
from elbow_gym.task.episodes import Episodes, Outcome
from elbow_gym.task.infos import Flags, masked, only, restarted
from elbow_gym.task.saved_state import as_arms, checked_marks, number_of_arms
from elbow_gym.task.settings import Settings


class ElbowArmVectorEnv(  # pyright: ignore[reportIncompatibleVariableOverride]
    TaskAttributes, VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]
):
    """`ElbowArmEnv` for `num_envs` arms at once; arm i equals a single environment seeded `seed + i`, bit for bit.

    Takes the arguments of `ElbowArmEnv` and

    Args:
        num_envs: number B of arms.
        autoreset_mode: "NextStep", "SameStep" or "Disabled" (then reset with `options={"reset_mask": ...}`).
        num_threads: threads over which blocks of arms are spread; the results do not depend on it.
        max_episode_steps: control periods after which an episode is truncated at the latest, as `gymnasium.make` has
            it; None or -1: `duration` alone counts.

    In the render mode "human" a window shows the first four arms.
    """

    metadata: dict[str, Any] = {**ElbowArmEnv.metadata, "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        *,
        elbows: int | tuple[int, ...] = 2,
        arm: str | ArmParameters | Mapping[str, Any] = "paper",
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        num_threads: int = 1,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        render_width: int = 640,
        render_height: int = 480,
        **settings: Any,
    ) -> None:
        check_arguments(settings, ElbowArmVectorEnv.__init__)
        modes = [mode.value for mode in AutoresetMode]
        if not isinstance(autoreset_mode, AutoresetMode):
            one_of("autoreset_mode", autoreset_mode, modes)
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        unlimited = max_episode_steps is None or max_episode_steps == -1
        longest = None if unlimited else positive_integer("max_episode_steps", max_episode_steps)
        self._episodes = Episodes(Settings(elbows=elbows, arm=arm, **settings), num_envs, num_threads, longest)
        self.num_envs = num_envs
        self.render_mode = render_mode
        self._viewer = Viewer(self._episodes, render_mode, render_width, render_height)
        self.metadata = {
            **self.metadata,
            "autoreset_mode": self.autoreset_mode,
            "render_fps": round(self.settings.control_frequency),
        }
        self.single_action_space = action_space(self._episodes)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.single_observation_space = observation_space(self._episodes)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._generators: list[np.random.Generator] = []
        self._seeds: list[int] = []
        self._over = np.zeros(num_envs, dtype=np.bool_)
        self._started = np.zeros(num_envs, dtype=np.bool_)

    @property
    def np_random(  # pyright: ignore[reportIncompatibleMethodOverride]
        self,
    ) -> tuple[np.random.Generator, ...]:
        """Random generators, one per arm."""
        self._seed(None, np.ones(self.num_envs, dtype=np.bool_))
        return tuple(self._generators)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Seeds, one per arm."""
        self._seed(None, np.ones(self.num_envs, dtype=np.bool_))
        return tuple(self._seeds)

    def _seed(self, seed: int | Sequence[int | None] | None, chosen: Flags) -> None:
        if not self._generators:
            drawn = [seeding.np_random() for _ in range(self.num_envs)]
            self._generators, self._seeds = [pair[0] for pair in drawn], [pair[1] for pair in drawn]
        if seed is None:
            return
        rule = f"seed must be an integer or one per arm ({self.num_envs})"
        try:
            # NumPy's integers are no ints.
            if isinstance(seed, numbers.Integral):
                first = int(seed)
                seeds = [first + i for i in range(self.num_envs)]
            else:
                seeds = [None if one is None else operator.index(one) for one in cast("Sequence[int | None]", seed)]
        except TypeError as error:
            raise ValueError(f"{rule}, got {seed!r}") from error
        if len(seeds) != self.num_envs:
            raise ValueError(f"{rule}, got {len(seeds)}")
        for i in np.flatnonzero(chosen):
            if seeds[i] is not None:
                self._generators[i], self._seeds[i] = seeding.np_random(seeds[i])

    def _reset_mask(self, options: Mapping[str, Any]) -> Flags:
        given = options.get("reset_mask")
        if given is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        rule = f"options['reset_mask'] must be a bool array of shape {(self.num_envs,)}, got {given!r}"
        try:
            mask: NDArray[Any] = np.asarray(given)
        except ValueError as error:
            raise ValueError(rule) from error
        if mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
            raise ValueError(rule)
        if not mask.any():
            raise ValueError(f"options['reset_mask'] must choose at least one arm, got {given!r}")
        return mask

    def reset(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Starts episodes in all arms, or in those of `options["reset_mask"]`. The other options are `ElbowArmEnv`'s.

        Raises ValueError naming a wrong option, with everything as it was.
        """
        given: Mapping[str, Any] = {} if options is None else as_dict("options", options)
        chosen = self._reset_mask(given)
        before = list(self._generators), list(self._seeds)
        try:
            self._seed(seed, chosen)
            rest = {key: value for key, value in given.items() if key != "reset_mask"}
            self._episodes.reset(self._generators, chosen, rest)
        except BaseException:
            self._generators, self._seeds = before
            raise
        self._over[chosen] = False
        self._started[chosen] = True
        self._viewer.restart(chosen)
        snapshot = self._episodes.observe(~chosen)
        return snapshot.observation, masked(self._episodes.info(snapshot), chosen)

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """One control period of every arm. Raises ValueError, with the state untouched, on a wrong shape or NaN."""
        if not self._started.all():
            raise gym.error.ResetNeeded(
                f"reset must be called before step, got arms {np.flatnonzero(~self._started)} never reset"
            )
        array = as_numbers("action", actions, (self.num_envs, self._episodes.arm.n_joints))
        waiting = self._over
        some_wait = bool(waiting.any())
        if some_wait and self.autoreset_mode is AutoresetMode.DISABLED:
            raise gym.error.ResetNeeded(
                f"reset must be called with options['reset_mask'] for arms that are over, got {np.flatnonzero(waiting)}"
            )
        outcome = self._play(array, waiting if some_wait else None)
        self._viewer.follow()
        over = outcome.terminated | outcome.truncated
        if not some_wait and not over.any():
            everyone = np.ones(self.num_envs, dtype=np.bool_)
            return (*outcome[:4], masked(outcome.info, everyone))
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            return self._same_step(outcome, over)
        info = outcome.info
        if some_wait:
            # Arms that ended a step ago start anew instead; what they did meanwhile does not count.
            self._episodes.reset(self._generators, waiting)
            self._viewer.restart(waiting)
            snapshot = self._episodes.observe(~waiting)
            outcome.observation[waiting] = snapshot.observation[waiting]
            for array in (outcome.reward, outcome.terminated, outcome.truncated):
                array[waiting] = 0
            info = restarted(info, self._episodes.info(snapshot), waiting)
        self._over = outcome.terminated | outcome.truncated
        return (*outcome[:4], masked(info, np.ones(self.num_envs, dtype=np.bool_)))

    def _play(self, actions: NDArray[np.float64], waiting: Flags | None) -> Outcome:
        """A control period of every arm, before those that are over start anew."""
        return self._episodes.step(actions, waiting)

    def _same_step(self, outcome: Any, over: Flags) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        final_obs = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(over):
            final_obs[i] = outcome.observation[i].copy()
        self._episodes.reset(self._generators, over)
        self._viewer.restart(over)
        snapshot = self._episodes.observe(~over)
        outcome.observation[over] = snapshot.observation[over]
        final_info = masked(only(outcome.info, over), over)
        info = restarted(outcome.info, self._episodes.info(snapshot), over)
        infos = masked(info, np.ones(self.num_envs, dtype=np.bool_))
        infos.update(final_obs=final_obs, _final_obs=over.copy(), final_info=final_info, _final_info=over.copy())
        return (*outcome[:4], infos)

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Fresh pictures (height, width, 3) of all arms in the mode "rgb_array"; None in "human". See `ElbowArmEnv`."""
        return self._viewer.render(bool(self._started.all()))

    def close_extras(self, **_kwargs: Any) -> None:
        """Closes the window, if there is one, and ends the threads; a later step starts them again."""
        # Gymnasium 1.2 closes what is collected, even if its construction has failed.
        if hasattr(self, "_viewer"):
            self._viewer.close()
            self._episodes.simulator.close()

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """An attribute of every arm, or a method's answer, as `SyncVectorEnv` has it; the method is called once."""
        return ask(self, name, *args, **kwargs)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of every arm, such as `action_space`, which is one arm's."""
        return ask(self, name)

    def set_attr(self, name: str, values: Any) -> None:
        """Sets an attribute of all arms, such as `energy_weight`, to a value, or to equal ones in a list.

        Raises AttributeError where there is no such attribute or it cannot be set, and ValueError for values that
        differ between arms.
        """
        assign(self, name, values)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        take_over(self)

    def get_state(self, arms: ArrayLike | None = None) -> dict[str, Any]:
        """Everything that changes from step to step, the random generators included.

        Args:
            arms: numbers of arms, or a mask (B,); all when None.
        """
        chosen = np.arange(self.num_envs) if arms is None else as_arms(arms, self.num_envs)
        generators = self.np_random
        return {
            "episodes": self._episodes.get_state(chosen),
            "generators": [generators[i].bit_generator.state for i in chosen],
            "over": self._over[chosen],
            "started": self._started[chosen],
        }

    def set_state(self, state: Mapping[str, Any], arms: ArrayLike | None = None) -> None:
        """Restores a state of `get_state`; the run goes on bit for bit.

        The settings must be those that the state was made with, but for weights, start, circle, duration and ranges.
        Raises ValueError naming what is wrong with a state, with everything as it was.

        Args:
            state: of this environment, or of another one with other arms or a single arm.
            arms: numbers of the arms, or a mask (B,), that take it: as many as it has, or any number for a state of
                one arm, which then goes on in all of them, each with a generator in the same state; all when None.
        """
        count = number_of_arms(state)
        chosen = np.arange(self.num_envs) if arms is None else as_arms(arms, self.num_envs)
        if count != len(chosen) and (count != 1 or arms is None):
            raise ValueError(f"state must be of {len(chosen)} arms, got one of {count}")
        generators = [self.np_random[i] for i in chosen]
        saved = self._episodes.checked(state["episodes"], count)
        marks = checked_marks(state, generators)
        self._episodes.put(chosen, saved, generators)
        for generator, mark in zip(generators, itertools.cycle(marks.generators), strict=False):
            generator.bit_generator.state = mark
        self._over[chosen], self._started[chosen] = marks.over, marks.started
        self._viewer.restart(None if arms is None else np.isin(np.arange(self.num_envs), chosen))

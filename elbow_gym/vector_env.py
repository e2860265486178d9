"""Gymnasium vector environment of B arms in one compiled call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import gymnasium as gym
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from elbow_gym.checks import as_numbers, non_negative, require_entries
from elbow_gym.env import ElbowArmEnv, action_space, observation_space
from elbow_gym.parameters import ArmParameters, Array
from elbow_gym.rendering.viewer import Viewer
from elbow_gym.task.episodes import Episodes
from elbow_gym.task.settings import Settings

Flags = NDArray[np.bool_]


class ElbowArmVectorEnv(VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]):
    """`ElbowArmEnv` for `num_envs` arms at once; arm i equals a single environment seeded `seed + i`, bit for bit.

    Takes the arguments of `ElbowArmEnv` and

    Args:
        num_envs: number B of arms.
        autoreset_mode: "NextStep", "SameStep" or "Disabled" (then reset with `options={"reset_mask": ...}`).
        num_threads: threads over which blocks of arms are spread; the results do not depend on it.

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
        render_mode: str | None = None,
        render_width: int = 640,
        render_height: int = 480,
        **settings: Any,
    ) -> None:
        modes = [mode.value for mode in AutoresetMode]
        if autoreset_mode not in [*AutoresetMode, *modes]:
            raise ValueError(f"autoreset_mode must be one of {modes}, got {autoreset_mode!r}")
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self._episodes = Episodes(Settings(elbows=elbows, arm=arm, **settings), num_envs, num_threads)
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
    def settings(self) -> Settings:
        """Arguments that the environment was made with."""
        return self._episodes.settings

    @property
    def episodes(self) -> Episodes:
        """Batch of the arms of this environment."""
        return self._episodes

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Name and unit of each entry of an arm's observation."""
        return self._episodes.layout.names

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

    def decode(self, observation: NDArray[np.float32]) -> dict[str, Array]:
        """Quantities of the observations in SI units, by feature name, each (B, size)."""
        return self._episodes.layout.decode(observation)

    def set_energy_weight(self, energy_weight: float) -> None:
        """Changes the cost per watt of electrical power [1/W] from the next step on."""
        self._episodes.energy_weight = non_negative("energy_weight", energy_weight)

    def set_tracking_weight(self, tracking_weight: float) -> None:
        """Changes the cost per metre of tracking error [1/m] from the next step on."""
        self._episodes.tracking_weight = non_negative("tracking_weight", tracking_weight)

    def _seed(self, seed: int | Sequence[int | None] | None, chosen: Flags) -> None:
        if not self._generators:
            drawn = [seeding.np_random() for _ in range(self.num_envs)]
            self._generators, self._seeds = [pair[0] for pair in drawn], [pair[1] for pair in drawn]
        if seed is None:
            return
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed must be an integer or one per arm ({self.num_envs}), got {len(seeds)}")
        for i in np.flatnonzero(chosen):
            if seeds[i] is not None:
                self._generators[i], self._seeds[i] = seeding.np_random(seeds[i])

    def _reset_mask(self, options: Mapping[str, Any]) -> Flags:
        given = options.get("reset_mask")
        if given is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        mask: NDArray[Any] = np.asarray(given)
        if mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
            raise ValueError(f"options['reset_mask'] must be a bool array of shape {(self.num_envs,)}, got {given!r}")
        if not mask.any():
            raise ValueError(f"options['reset_mask'] must choose at least one arm, got {given!r}")
        return mask

    def reset(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Starts episodes in all arms, or in those of `options["reset_mask"]`. The other options are `ElbowArmEnv`'s.

        Raises ValueError naming a wrong option, with everything as it was.
        """
        options = {} if options is None else options
        chosen = self._reset_mask(options)
        before = list(self._generators), list(self._seeds)
        try:
            self._seed(seed, chosen)
            rest = {key: value for key, value in options.items() if key != "reset_mask"}
            self._episodes.reset(self._generators, chosen, rest)
        except (ValueError, gym.error.Error):
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
        outcome = self._episodes.step(array, waiting if some_wait else None)
        self._viewer.follow()
        over = outcome.terminated | outcome.truncated
        if not some_wait and not over.any():
            everyone = np.ones(self.num_envs, dtype=np.bool_)
            return (*outcome[:4], masked(outcome.info, everyone))
        if self.autoreset_mode is AutoresetMode.SAME_STEP:
            return self._same_step(outcome, over)
        drawn: dict[str, Any] = {}
        if some_wait:
            # Arms that ended a step ago start anew instead; what they did meanwhile does not count.
            self._episodes.reset(self._generators, waiting)
            self._viewer.restart(waiting)
            snapshot = self._episodes.observe(~waiting)
            info = self._episodes.info(snapshot)
            outcome.observation[waiting] = snapshot.observation[waiting]
            for array in (outcome.reward, outcome.terminated, outcome.truncated):
                array[waiting] = 0
            for key, rows in outcome.info.items():
                rows[waiting] = info[key][waiting]
            drawn = masked(drawn_only(info, outcome.info), waiting)
        self._over = outcome.terminated | outcome.truncated
        return (*outcome[:4], {**masked(outcome.info, np.ones(self.num_envs, dtype=np.bool_)), **drawn})

    def _same_step(self, outcome: Any, over: Flags) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        final_obs = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(over):
            final_obs[i] = outcome.observation[i].copy()
        self._episodes.reset(self._generators, over)
        self._viewer.restart(over)
        snapshot = self._episodes.observe(~over)
        info = self._episodes.info(snapshot)
        outcome.observation[over] = snapshot.observation[over]
        final_info: dict[str, Any] = {
            key: np.where(spread(over, rows), rows, np.zeros_like(rows)) for key, rows in outcome.info.items()
        }
        for key, rows in outcome.info.items():
            rows[over] = info[key][over]
        infos = masked(outcome.info, np.ones(self.num_envs, dtype=np.bool_))
        infos.update(masked(drawn_only(info, outcome.info), over))
        infos.update(final_obs=final_obs, _final_obs=over.copy(), final_info=masked(final_info, over))
        infos["_final_info"] = over.copy()
        return (*outcome[:4], infos)

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Fresh pictures (height, width, 3) of all arms in the mode "rgb_array"; None in "human". See `ElbowArmEnv`."""
        return self._viewer.render(bool(self._started.all()))

    def close_extras(self, **_kwargs: Any) -> None:
        """Closes the window, if there is one."""
        self._viewer.close()

    def get_state(self) -> dict[str, Any]:
        """Everything that changes from step to step, the random generators included."""
        return {
            "episodes": self._episodes.get_state(),
            "generators": [generator.bit_generator.state for generator in self.np_random],
            "over": self._over.copy(),
            "started": self._started.copy(),
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restores a state of `get_state`; the run goes on bit for bit."""
        require_entries(state, ("episodes", "generators", "over", "started"), "state")
        if len(state["generators"]) != self.num_envs:
            raise ValueError(f"state['generators'] must have {self.num_envs} entries, got {len(state['generators'])}")
        self._episodes.set_state(state["episodes"], self.np_random)
        for generator, saved in zip(self.np_random, state["generators"], strict=True):
            generator.bit_generator.state = saved
        self._over = np.array(state["over"], dtype=np.bool_)
        self._started = np.array(state["started"], dtype=np.bool_)
        self._viewer.restart()


def spread(mask: Flags, rows: Array) -> Flags:
    """The mask (B,) with trailing axes, so that it broadcasts against rows (B, ...)."""
    return mask.reshape(-1, *([1] * (rows.ndim - 1)))


def drawn_only(info: Mapping[str, Any], flows: Mapping[str, Any]) -> dict[str, Any]:
    """Entries of a reset's info that a step's has not: the values that were drawn."""
    return {key: rows for key, rows in info.items() if key not in flows}


def masked(info: Mapping[str, Any], mask: Flags) -> dict[str, Any]:
    """Gymnasium's vector info: each key beside its `_key` mask of the arms that have it, and so in dicts inside."""
    full: dict[str, Any] = {
        key: masked(cast("dict[str, Any]", rows), mask) if isinstance(rows, dict) else rows
        for key, rows in info.items()
    }
    full.update({f"_{key}": mask.copy() for key in info})
    return full

"""Adapter of the batched environment to Stable-Baselines3. No other module of the package needs that library."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from elbow_gym.env import action_space, observation_space
from elbow_gym.vector_env import ElbowArmVectorEnv

Indices = int | Iterable[int] | None


class SB3VecEnv(VecEnv):
    """A `VecEnv` over an `ElbowArmVectorEnv`, without a Python loop over the arms.

    Infos stay small for speed: an arm's dict is empty until its episode ends, and then holds the whole final info,
    `terminal_observation` and `TimeLimit.truncated`.

    Args:
        env: the batched environment, made with `autoreset_mode="SameStep"`. ValueError otherwise.
    """

    def __init__(self, env: ElbowArmVectorEnv) -> None:
        if env.autoreset_mode is not AutoresetMode.SAME_STEP:
            raise ValueError(f"autoreset_mode must be {AutoresetMode.SAME_STEP}, got {env.autoreset_mode}")
        self.env = env
        self._actions: NDArray[np.float32] = np.zeros(env.action_space.shape or (), dtype=np.float32)
        super().__init__(env.num_envs, observation_space(env.episodes), action_space(env.episodes))
        self.metadata = env.metadata

    def reset(self) -> NDArray[np.float32]:
        """Starts all episodes, once with the seeds and options that were set before."""
        seeds = None if all(seed is None for seed in self._seeds) else list(self._seeds)
        given = [options for options in self._options if options]
        if given and any(options != given[0] for options in self._options):
            raise ValueError(f"options must be the same for every arm, got {self._options}")
        observation, _ = self.env.reset(seed=seeds, options=given[0] if given else None)
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return observation

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keeps the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """One control period; arms that end start anew at once."""
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        over = terminated | truncated
        for i in np.flatnonzero(over):
            infos[i] = {key: rows[i] for key, rows in info["final_info"].items() if not key.startswith("_")}
            if "overheated" in infos[i]:
                infos[i]["overheated"] = bool(infos[i]["overheated"])
            infos[i]["terminal_observation"] = info["final_obs"][i]
            infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
        return observation, reward.astype(np.float32), over, infos

    def close(self) -> None:
        """Closes the environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """Attribute of the batched environment, once per arm asked for."""
        return [getattr(self.env, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Sets an attribute of the batched environment, so of every arm."""
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Calls a method of the batched environment once; its answer is repeated per arm asked for."""
        answer = getattr(self.env, method_name)(*method_args, **method_kwargs)
        return [answer] * len(list(self._get_indices(indices)))

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:
        """False for each arm asked for: the arms have no wrappers."""
        return [False] * len(list(self._get_indices(indices)))

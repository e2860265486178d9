"""Adapter of the batched environment to Stable-Baselines3. No other module of the package needs that library."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from typing import Any, cast

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv

from elbow_gym.task.arm_access import Batch, ask, assign, layers
from elbow_gym.task.infos import of_arm, unmasked
from elbow_gym.vector_env import ElbowArmVectorEnv

Indices = int | Iterable[int] | None
Pixels = NDArray[np.uint8]

OTHER_FORMS = {"ArrayConversion", "DictInfoToList"}
"""Wrappers of Gymnasium, those derived from them included, after which arrays or infos are not what is read here."""


class SB3VecEnv(VecEnv):
    """A `VecEnv` over an `ElbowArmVectorEnv`, without a Python loop over the arms.

    Infos stay small for speed: an arm's dict is empty until its episode ends, and then holds the whole final info,
    `terminal_observation` and `TimeLimit.truncated`. `reset_infos` holds each arm's info of its last reset.

    Args:
        env: the batched environment, made with `autoreset_mode="SameStep"`, or Gymnasium's vector wrappers around it
            that work in this mode: of rewards, actions and episode statistics.

    Raises:
        ValueError: `env` is something else; the message says what.
    """

    def __init__(self, env: Batch) -> None:
        batch = _checked(env)
        self.env = env
        self._actions: NDArray[np.float32] = np.zeros(batch.action_space.shape or (), dtype=np.float32)
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        self.metadata = env.metadata

    def reset(self) -> NDArray[np.float32]:
        """Starts all episodes, once with the seeds and options that were set before."""
        seeds = None if all(seed is None for seed in self._seeds) else list(self._seeds)
        given = [options for options in self._options if options]
        if given and any(options != given[0] for options in self._options):
            raise ValueError(f"options must be the same for every arm, got {self._options}")
        # Gymnasium names one seed only, and the batch takes one per arm.
        observation, info = self.env.reset(seed=cast("Any", seeds), options=given[0] if given else None)
        self._keep(info, range(self.num_envs))
        self._reset_seeds()
        self._reset_options()
        return observation

    def _keep(self, info: dict[str, Any], arms: Iterable[int]) -> None:
        plain = unmasked(info)
        for i in arms:
            self.reset_infos[i] = of_arm(plain, i)

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keeps the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """One control period; arms that end start anew at once."""
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        over = terminated | truncated
        if over.any():
            final, last = info.pop("final_info"), info.pop("final_obs")
            # Wrappers add entries for the episodes that are over, such as `episode`.
            added = {key: rows for key, rows in info.items() if not key.startswith("_") and key not in final}
            for key in added:
                del info[key]
            ended, arms = unmasked({**final, **added}), np.flatnonzero(over).tolist()
            for i in arms:
                infos[i] = of_arm(ended, i)
                infos[i]["terminal_observation"] = last[i]
                infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
            self._keep(info, arms)
        return observation, reward.astype(np.float32), over, infos

    def get_images(self) -> Sequence[Pixels | None]:
        """Fresh pictures of the arms, (height, width, 3), with sides that are even, as players of mp4 need them.

        An odd side gets a last row or column twice. None for each arm unless the render mode is "rgb_array".
        """
        if self.render_mode != "rgb_array":
            warnings.warn(f"render_mode must be 'rgb_array' for pictures, got {self.render_mode!r}", stacklevel=2)
            return [None] * self.num_envs
        pictures = cast("tuple[Pixels, ...]", self.env.render())
        return [np.pad(one, [(0, one.shape[0] % 2), (0, one.shape[1] % 2), (0, 0)], "edge") for one in pictures]

    def close(self) -> None:
        """Closes the environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """Attribute of each arm asked for, such as `action_space`, which is one arm's."""
        values = ask(self.env, attr_name)
        return [values[i] for i in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Sets an attribute of all arms, such as `energy_weight`.

        Raises ValueError for some of the arms, and AttributeError where there is none or it cannot be set.
        """
        self._check_all(attr_name, indices)
        assign(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Calls a method of the batch once; its answer for each arm. ValueError for some of the arms."""
        self._check_all(method_name, indices)
        return list(ask(self.env, method_name, *method_args, **method_kwargs))

    def _check_all(self, name: str, indices: Indices) -> None:
        asked = sorted({int(i) % self.num_envs for i in self._get_indices(indices)})
        if asked != list(range(self.num_envs)):
            raise ValueError(f"indices of {name} must be all {self.num_envs} arms, which share it, got {asked}")

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:
        """Whether the batch has such a wrapper of Gymnasium's, for each arm asked for."""
        wrapped = any(isinstance(layer, wrapper_class) for layer in layers(self.env)[:-1])
        return [wrapped] * len(list(self._get_indices(indices)))


def _checked(env: Batch) -> ElbowArmVectorEnv:
    """The batch inside `env`. Raises the errors of `SB3VecEnv`."""
    how = 'such as gymnasium.make_vec("ElbowArm-v0", num_envs=16, autoreset_mode="SameStep")'
    if not isinstance(env, VectorEnv):
        raise ValueError(f"env must be a batch, {how}, got {env}")
    *wrappers, batch = layers(env)
    if not isinstance(batch, ElbowArmVectorEnv):
        raise ValueError(f"env must be a batch of elbow_gym's, {how}, got {env}")
    if hasattr(batch, "reward_space"):
        raise ValueError(f"env must have one reward per arm, {how}, got {env}")
    for wrapper in wrappers:
        name = type(wrapper).__name__
        if OTHER_FORMS & {kind.__name__ for kind in type(wrapper).__mro__}:
            raise ValueError(
                f'env with autoreset_mode="SameStep" must give NumPy arrays and a dict of infos, got {name}'
            )
    if batch.autoreset_mode is not AutoresetMode.SAME_STEP:
        raise ValueError(
            f'autoreset_mode must be given as autoreset_mode="SameStep", got {batch.autoreset_mode} of {env}'
        )
    return batch

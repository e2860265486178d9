"""Start of a training: a policy's weights, or data from a controller that works and their imitation."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.control.classical import ComputedTorque
from agents.learning.actor import actor_layers
from agents.learning.sac.settings import SACSettings
from elbow_gym.baselines.policy import Policy
from elbow_gym.interface import Interface
from elbow_gym.vector_env import ElbowArmVectorEnv


class Demonstrations(NamedTuple):
    """Observations of a controller and its actions, control period by control period."""

    observations: NDArray[np.float32]
    """Observations of the environment [-], shape (periods, arms, size)."""
    actions: NDArray[np.float32]
    """Actions in units of the actor's output [-], in [-1, 1], shape (periods, arms, n)."""


def take_over(model: Any, policy: Policy) -> None:
    """Copies a policy's weights into the actor of an SB3 model.

    Raises:
        ValueError: the actor has other layers.
    """
    import torch

    linear = [layer for layer in actor_layers(model) if isinstance(layer, torch.nn.Linear)]
    layers = (linear[0].in_features, *(layer.out_features for layer in linear))
    if layers != policy.card.layers:
        raise ValueError(f"layers of the first policy must be {layers} like the actor's, got {policy.card.layers}")
    with torch.no_grad():
        for k, layer in enumerate(linear):
            layer.weight.copy_(torch.from_numpy(policy.weights[f"weight_{k}"]))
            layer.bias.copy_(torch.from_numpy(policy.weights[f"bias_{k}"]))


def fill(
    model: Any, sac: SACSettings, env: ElbowArmVectorEnv, seed: int, progress: Callable[[int], Any] = lambda _: None
) -> Demonstrations:
    """Fills the replay buffer with `learning_starts` control periods of `warm_start`, counted as the model's own.

    Each arm's noise has its own strength, up to twice `warm_start_noise`, so that the data show both how the task is
    done and what happens beside it.

    Args:
        model: Stable-Baselines3's SAC with its environment.
        sac: settings of the SAC.
        env: the batched environment under the model's.
        seed: seed of the noise.
        progress: called with the number of control periods so far.

    Returns:
        Observations of computed torque and its actions without the noise; empty with another `warm_start`.
    """
    rng = np.random.default_rng(seed)
    monitored = model.get_env()
    observation = monitored.reset()
    interface, k = Interface(env), 0
    shape = (env.num_envs, interface.arm.n_joints)
    controller, strength = ComputedTorque(env), np.zeros((env.num_envs, 1))
    seen: list[NDArray[np.float32]] = []
    done: list[NDArray[np.float32]] = []
    while model.num_timesteps < sac.learning_starts:
        if k % interface.horizon == 0:
            # It counts the time by its calls; all arms start and end together.
            controller = ComputedTorque(env)
            strength = 2.0 * sac.warm_start_noise * rng.random((env.num_envs, 1))
        if sac.warm_start == "pd":
            calm = controller.predict(observation)[0]
            seen.append(observation)
            done.append(model.policy.scale_action(calm))
            action = calm + interface.highest_action * strength * rng.normal(size=shape)
            action = np.clip(action, monitored.action_space.low, monitored.action_space.high).astype(np.float32)
        else:
            action = model.predict(observation, deterministic=False)[0]
        after, reward, over, infos = monitored.step(action)
        reached: NDArray[np.float32] = after.copy()
        for i in np.flatnonzero(over):
            reached[i] = infos[i]["terminal_observation"]
        stored = model.policy.scale_action(action)
        model.replay_buffer.add(observation, reached, stored, reward, over, infos)
        observation, k = after, k + 1
        model.num_timesteps += env.num_envs
        progress(model.num_timesteps)
    return Demonstrations(np.array(seen, np.float32), np.array(done, np.float32))


def imitate(model: Any, shown: Demonstrations, steps: int, seed: int, batch_size: int = 512) -> None:
    """Fits the mean of the actor of a `sac.agent.SAC` to demonstrations by squared error, and its copies with it.

    Args:
        model: the SAC.
        shown: demonstrations of at least one control period.
        steps: number of gradient steps, at a learning rate that falls linearly from 0.002.
        seed: seed of the batches.
        batch_size: number of samples in each gradient step.
    """
    import torch

    from agents.learning.fit import Fit

    rng = np.random.default_rng(seed)
    seen, done = (part.reshape(-1, part.shape[-1]) for part in shown)
    # The actor's own parameters keep their places in the memory of its optimizer.
    actor = actor_layers(model)
    copied = copy.deepcopy(actor)
    fit = Fit(copied, squashed=True)
    for k in range(steps):
        fit.step(rng.integers(len(seen), size=batch_size), seen, done, 2e-3 * (1.0 - k / steps))
    with torch.no_grad():
        for layer, other in zip(actor, copied, strict=True):
            for own, fitted in zip(layer.parameters(), other.parameters(), strict=True):
                own.copy_(fitted)
    model.policy.follow(1.0, 1.0)

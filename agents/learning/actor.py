"""The actor of a trained model as a policy, and the policy's two files."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from agents.files import copy_whole, write_whole
from elbow_gym.baselines.policy import Policy, Weights, pair
from elbow_gym.baselines.policy_card import PolicyCard
from elbow_gym.task.settings import Settings


def policy_of(model: Any, settings: Settings, command: str, env: str = "ElbowArm-v0", **more: dict[str, Any]) -> Policy:
    """The deterministic actor of an SB3 model (PPO's, SAC's or TD3's kind) as a `Policy`.

    The statistics of a `VecNormalize` go into the first layer, so that the policy takes plain observations. It acts as
    the model while no entry is more than `clip_obs` standard deviations off its mean, where `VecNormalize` clips it.

    Args:
        model: with the environment that it was trained in, an `SB3VecEnv` or SB3's own, in wrappers or not.
        settings: the environment's, JSON types only.
        command: what made it.
        env: the environment's id.
        more: further fields of the card.

    Raises:
        ValueError: the actor has activations of several kinds, a wrapper changes its observations or actions in a way
            that no layer can take up, or an entry of the observation has not varied, so that it has no scale.
    """
    import torch

    actor = played_layers(model)
    linear = [layer for layer in actor if isinstance(layer, torch.nn.Linear)]
    kinds = {type(layer).__name__.lower() for layer in actor} - {"linear"}
    if len(kinds) != 1:
        raise ValueError(f"the actor must have one kind of activation, got {sorted(kinds)}")
    weights: Weights = {}
    for k, layer in enumerate(linear):
        weights[f"weight_{k}"] = layer.weight.detach().cpu().numpy().copy()
        weights[f"bias_{k}"] = layer.bias.detach().cpu().numpy().copy()
    names = tuple(model.get_env().get_attr("observation_names", 0)[0])
    _take_up_normalisation(weights, model, names)
    card = PolicyCard(
        algorithm=type(model).__name__.lower(),
        environment=json.loads(json.dumps(settings.arguments)),
        observation=names,
        layers=(linear[0].in_features, *(layer.out_features for layer in linear)),
        activation=kinds.pop(),
        command=command,
        env=env,
        output="tanh" if hasattr(model.policy, "actor") else "clip",
        **{name: json.loads(json.dumps(value)) for name, value in more.items()},
    )
    return Policy(card, weights)


def _take_up_normalisation(weights: Weights, model: Any, names: Sequence[str]) -> None:
    """Puts the means and scales of a `VecNormalize` into the first layer. Raises the errors of `policy_of`."""
    _check_wrappers(model.get_env())
    normaliser = model.get_vec_normalize_env()
    if normaliser is None or not normaliser.norm_obs:
        return
    mean, variance = normaliser.obs_rms.mean, normaliser.obs_rms.var
    still = [name for name, value in zip(names, variance, strict=True) if not value > normaliser.epsilon]
    if still:
        raise ValueError(f"observations behind VecNormalize must have varied in training, got constant {still}")
    scaled = weights["weight_0"] / np.sqrt(variance + normaliser.epsilon)
    weights["bias_0"] = (weights["bias_0"] - scaled @ mean).astype(np.float32)
    weights["weight_0"] = scaled.astype(np.float32)


def _check_wrappers(env: Any) -> None:
    """Raises ValueError naming a wrapper that changes observations or actions in another way than `VecNormalize`."""
    import gymnasium as gym
    from stable_baselines3.common.vec_env import VecCheckNan, VecMonitor, VecNormalize, VecVideoRecorder
    from stable_baselines3.common.vec_env.base_vec_env import VecEnvWrapper

    changing = []
    layer = env
    while isinstance(layer, VecEnvWrapper):
        if not isinstance(layer, VecMonitor | VecNormalize | VecCheckNan | VecVideoRecorder):
            changing.append(type(layer).__name__)
        layer = layer.venv
    kinds = (gym.ObservationWrapper, gym.ActionWrapper, gym.vector.VectorObservationWrapper)
    kinds += (gym.vector.VectorActionWrapper,)
    changing += [kind.__name__ for kind in kinds if any(layer.env_is_wrapped(kind))]
    if changing:
        raise ValueError(f"model must be trained on the environment's own observations and actions, got {changing[0]}")


def played_layers(model: Any) -> list[Any]:
    """The torch layers from the observation to what an SB3 model of `policy_of` does deterministically."""
    return list(model.policy.average)[:-1] if hasattr(model.policy, "average") else actor_layers(model)


def actor_layers(model: Any) -> list[Any]:
    """The torch layers from the observation to the mean action of the actor that learns."""
    if hasattr(model.policy, "actor"):
        actor = model.policy.actor
        # TD3's is one network that ends in the tanh, SAC's has the tanh outside.
        return [*actor.latent_pi, actor.mu] if hasattr(actor, "latent_pi") else list(actor.mu)[:-1]
    return [*model.policy.mlp_extractor.policy_net, model.policy.action_net]


def save_policy(policy: Policy, path: Path) -> None:
    """Writes `path`.safetensors and `path`.json, each whole or not at all."""
    for file, content in reversed(files_of(policy, path).items()):
        write_whole(file, lambda temporary, content=content: temporary.write_bytes(content))


def files_of(policy: Policy, path: Path) -> dict[Path, bytes]:
    """Contents of `path`.json and `path`.safetensors, in this order."""
    # Into memory: safetensors hides an operating system's error, such as that of a full disk.
    from safetensors.numpy import save

    card, weights = pair(path)
    return {card: (json.dumps(asdict(policy.card), indent=2) + "\n").encode(), weights: save(policy.weights)}


def copy_policy(source: Path, target: Path) -> None:
    """Copies a policy to `target`.safetensors and `target`.json, each whole; both names with or without suffix.

    The card comes last, because a policy is found by it.
    """
    for old, new in reversed(list(zip(pair(source), pair(target), strict=True))):
        copy_whole(old, new)

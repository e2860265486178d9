"""The actor of a trained model as a policy, and the policy's two files."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from agents.files import copy_whole, write_whole
from elbow_gym.baselines.policy import Policy, Weights, pair
from elbow_gym.baselines.policy_card import PolicyCard
from elbow_gym.task.settings import Settings

BEST = "best"
"""Name of the best policy's files in a run's folder and in its checkpoints."""


def policy_of(model: Any, settings: Settings, command: str, env: str = "ElbowArm-v0", **more: dict[str, Any]) -> Policy:
    """The deterministic actor of an SB3 model (PPO's or SAC's kind) as a `Policy`.

    Args:
        model: with the `SB3VecEnv` that it was trained in.
        settings: the environment's, JSON types only.
        command: what made it.
        env: the environment's id.
        more: further fields of the card.
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
    card = PolicyCard(
        algorithm=type(model).__name__.lower(),
        environment=json.loads(json.dumps(settings.arguments)),
        observation=tuple(model.get_env().get_attr("observation_names", 0)[0]),
        layers=(linear[0].in_features, *(layer.out_features for layer in linear)),
        activation=kinds.pop(),
        command=command,
        env=env,
        output="tanh" if hasattr(model.policy, "actor") else "clip",
        **{name: json.loads(json.dumps(value)) for name, value in more.items()},
    )
    return Policy(card, weights)


def played_layers(model: Any) -> list[Any]:
    """The torch layers from the observation to what an SB3 model of PPO's or SAC's kind does deterministically."""
    return list(model.policy.average)[:-1] if hasattr(model.policy, "average") else actor_layers(model)


def actor_layers(model: Any) -> list[Any]:
    """The torch layers from the observation to the mean action of the actor that learns."""
    if hasattr(model.policy, "actor"):
        return [*model.policy.actor.latent_pi, model.policy.actor.mu]
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

"""Policies as safetensors and JSON: they run on NumPy alone and refuse an environment they were not made for."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.files import write_text, write_whole
from elbow_gym.env import ElbowArmEnv
from elbow_gym.settings import Settings
from elbow_gym.task import OBSERVATION_VERSION, ObservationLayout
from elbow_gym.vector_env import ElbowArmVectorEnv

SHIPPED = Path(__file__).parent / "policies"
FORMAT = 1
ACTIVATIONS = {"tanh": np.tanh, "relu": lambda x: np.maximum(x, 0.0)}

Weights = dict[str, NDArray[np.float32]]


@dataclass(frozen=True)
class PolicyCard:
    """Everything about a policy but its weights."""

    algorithm: str
    environment: dict[str, Any]
    """`Settings` of the environment it was trained in, JSON types only."""
    observation: tuple[str, ...]
    """Names and units of the observation's entries."""
    layers: tuple[int, ...]
    """Sizes from observation to action."""
    activation: str
    command: str
    """What made it."""
    observation_version: int = OBSERVATION_VERSION
    format: int = FORMAT
    training: dict[str, Any] = field(default_factory=dict)
    evaluation: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)


class Policy:
    """A deterministic multilayer perceptron with SB3's `predict`.

    Args:
        card: what it is.
        weights: `weight_k` (out, in) and `bias_k` (out,) of every layer k.

    Raises:
        ValueError: the card and the weights do not fit each other.
    """

    def __init__(self, card: PolicyCard, weights: Mapping[str, NDArray[np.float32]]) -> None:
        if card.format != FORMAT:
            raise ValueError(f"format of the policy must be {FORMAT}, got {card.format}")
        if card.activation not in ACTIVATIONS:
            raise ValueError(f"activation must be one of {sorted(ACTIVATIONS)}, got {card.activation!r}")
        for k, (size, after) in enumerate(zip(card.layers[:-1], card.layers[1:], strict=True)):
            for name, shape in ((f"weight_{k}", (after, size)), (f"bias_{k}", (after,))):
                if name not in weights or weights[name].shape != shape:
                    got = weights[name].shape if name in weights else "nothing"
                    raise ValueError(f"{name} must have shape {shape}, got {got}")
        self.card = card
        self.weights: Weights = dict(weights)

    def check(self, env: ElbowArmEnv | ElbowArmVectorEnv) -> None:
        """Raises ValueError when the environment's observation or action is not the one that it was trained with."""
        if self.card.observation_version != OBSERVATION_VERSION:
            raise ValueError(
                f"observation_version of the policy must be {OBSERVATION_VERSION}, got {self.card.observation_version}"
            )
        names = env.unwrapped.observation_names
        if self.card.observation != names:
            raise ValueError(
                f"observation of the policy must be the environment's {names}, got {self.card.observation}"
            )
        trained, given = self.settings, env.unwrapped.settings
        for name in ("elbow_joints", "action_unit", "voltage_limit", "control_frequency"):
            if getattr(trained, name) != getattr(given, name):
                raise ValueError(
                    f"{name} of the environment must be {getattr(trained, name)!r} as in training, "
                    f"got {getattr(given, name)!r}"
                )

    @property
    def settings(self) -> Settings:
        """The environment that it was trained in."""
        return Settings(**self.card.environment)

    def predict(
        self, observation: NDArray[np.float32], *_args: Any, **_kwargs: Any
    ) -> tuple[NDArray[np.float32], None]:
        """Actions (..., n) in [-1, 1] for observations (..., size)."""
        x = np.asarray(observation, dtype=np.float32)
        if x.shape[-1] != self.card.layers[0]:
            raise ValueError(f"observation must have {self.card.layers[0]} entries, got {x.shape[-1]}")
        activation, last = ACTIVATIONS[self.card.activation], len(self.card.layers) - 2
        for k in range(last + 1):
            x = x @ self.weights[f"weight_{k}"].T + self.weights[f"bias_{k}"]
            x = activation(x) if k < last else x
        return np.clip(x, -1.0, 1.0), None

    def save(self, path: Path) -> None:
        """Writes `path`.safetensors and `path`.json, each whole or not at all."""
        from safetensors.numpy import save_file

        card, weights = pair(path)
        write_whole(weights, lambda temporary: save_file(self.weights, temporary))
        write_text(card, json.dumps(asdict(self.card), indent=2) + "\n")


def load_policy(source: str | Path, elbows: int | None = None) -> Policy:
    """A policy from a file (with or without suffix), or a shipped one: `load_policy("ppo", elbows=2)`.

    Raises:
        ValueError: there is no such policy, or its files do not fit each other.
    """
    from safetensors.numpy import load_file

    card_path, weights_path = pair(Path(source) if elbows is None else SHIPPED / f"{source}_elbows{elbows}")
    for needed in (card_path, weights_path):
        if not needed.is_file():
            raise ValueError(
                f"policy must be one of {shipped_policies()} or the path of a pair of files, got no {needed}"
            )
    try:
        plain = json.loads(card_path.read_text(encoding="utf-8"))
        card = PolicyCard(**{**plain, "layers": tuple(plain["layers"]), "observation": tuple(plain["observation"])})
    except (TypeError, KeyError, json.JSONDecodeError) as error:
        raise ValueError(f"policy card must hold the fields of PolicyCard, got {card_path}: {error}") from error
    return Policy(card, load_file(weights_path))


def pair(path: Path) -> tuple[Path, Path]:
    """The card's and the weights' file of a policy named with or without either's suffix."""
    stem = path.with_suffix("") if path.suffix in (".json", ".safetensors") else path
    return stem.with_name(f"{stem.name}.json"), stem.with_name(f"{stem.name}.safetensors")


def shipped_policies() -> list[str]:
    """Names of the policies that come with the project."""
    return sorted(path.stem for path in SHIPPED.glob("*.json"))


def policy_of(model: Any, settings: Settings, command: str, **more: dict[str, Any]) -> Policy:
    """The deterministic actor of an SB3 on-policy model as a `Policy`. `settings` must hold JSON types only."""
    import torch

    actor = [*model.policy.mlp_extractor.policy_net, model.policy.action_net]
    linear = [layer for layer in actor if isinstance(layer, torch.nn.Linear)]
    kinds = {type(layer).__name__.lower() for layer in actor} - {"linear"}
    if len(kinds) != 1:
        raise ValueError(f"the actor must have one kind of activation, got {sorted(kinds)}")
    weights: Weights = {}
    for k, layer in enumerate(linear):
        weights[f"weight_{k}"] = layer.weight.detach().cpu().numpy().copy()
        weights[f"bias_{k}"] = layer.bias.detach().cpu().numpy().copy()
    layout = ObservationLayout(settings.parsed_arm.n_joints)
    card = PolicyCard(
        algorithm=type(model).__name__.lower(),
        environment=json.loads(json.dumps(settings.arguments)),
        observation=layout.names,
        layers=(linear[0].in_features, *(layer.out_features for layer in linear)),
        activation=kinds.pop(),
        command=command,
        **{name: json.loads(json.dumps(value)) for name, value in more.items()},
    )
    return Policy(card, weights)

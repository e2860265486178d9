"""Policies as safetensors and JSON: they run on NumPy alone and refuse an environment they were not made for."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.files import write_text, write_whole
from agents.tasks import task_name
from elbow_gym.env import ElbowArmEnv
from elbow_gym.task.observation import OBSERVATION_VERSION
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

SHIPPED = Path(__file__).parent / "policies"
FORMAT = 1
ACTIVATIONS = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
    "silu": lambda x: x * np.exp(-np.logaddexp(0.0, -x)),
}
OUTPUTS = {"clip": lambda x: np.clip(x, -1.0, 1.0), "tanh": np.tanh}
"""How the last layer becomes an action: PPO's is clipped, SAC's squashed."""

Weights = dict[str, NDArray[np.float32]]


@dataclass(frozen=True)
class PolicyCard:
    """Everything about a policy but its weights."""

    algorithm: str
    environment: dict[str, Any]
    """`Settings` of the environment it was trained for, JSON types only."""
    observation: tuple[str, ...]
    """Names and units of the observation's entries."""
    layers: tuple[int, ...]
    """Sizes from observation to action."""
    activation: str
    """Between the layers, one of `ACTIVATIONS`."""
    command: str
    """What made it."""
    env: str = "ElbowArm-v0"
    """Gymnasium's id of that environment."""
    output: str = "clip"
    """Of the last layer, one of `OUTPUTS`."""
    digest: str = ""
    """SHA-256 of the weights."""
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
        for name, known in (("activation", ACTIVATIONS), ("output", OUTPUTS)):
            if getattr(card, name) not in known:
                raise ValueError(f"{name} must be one of {sorted(known)}, got {getattr(card, name)!r}")
        for k, (size, after) in enumerate(zip(card.layers[:-1], card.layers[1:], strict=True)):
            for name, shape in ((f"weight_{k}", (after, size)), (f"bias_{k}", (after,))):
                if name not in weights or weights[name].shape != shape:
                    got = weights[name].shape if name in weights else "nothing"
                    raise ValueError(f"{name} must have shape {shape}, got {got}")
        digest = digest_of(weights)
        if card.digest not in ("", digest):
            raise ValueError(f"weights must be those of the card, with the digest {card.digest}, got {digest}")
        self.card = replace(card, digest=digest)
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
        return OUTPUTS[self.card.output](x).astype(np.float32, copy=False), None

    def module(self) -> Any:
        """The same as a `torch.nn.Sequential` that maps observations to actions, for whoever trains on."""
        import torch

        kinds = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU, "elu": torch.nn.ELU, "silu": torch.nn.SiLU}
        layers: list[Any] = []
        for k, (size, after) in enumerate(zip(self.card.layers[:-1], self.card.layers[1:], strict=True)):
            linear = torch.nn.Linear(size, after)
            with torch.no_grad():
                linear.weight.copy_(torch.from_numpy(self.weights[f"weight_{k}"]))
                linear.bias.copy_(torch.from_numpy(self.weights[f"bias_{k}"]))
            layers += [linear, kinds[self.card.activation]()]
        layers[-1] = torch.nn.Tanh() if self.card.output == "tanh" else torch.nn.Hardtanh()
        return torch.nn.Sequential(*layers)

    def save(self, path: Path) -> None:
        """Writes `path`.safetensors and `path`.json, each whole or not at all."""
        from safetensors.numpy import save_file

        card, weights = pair(path)
        write_whole(weights, lambda temporary: save_file(self.weights, temporary))
        write_text(card, json.dumps(asdict(self.card), indent=2) + "\n")


def digest_of(weights: Mapping[str, NDArray[np.float32]]) -> str:
    """SHA-256 of the weights, name by name."""
    digest = hashlib.sha256()
    for name in sorted(weights):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(weights[name], dtype="<f4").tobytes())
    return digest.hexdigest()


def load_policy(
    source: str | Path, elbows: int | None = None, env: str | None = None, seed: int | None = None
) -> Policy:
    """A policy from a file, or a shipped one: `load_policy("ppo", elbows=2)`, `load_policy("ppo", env="...")`.

    Args:
        source: a path with or without suffix; with `elbows` or `env` a shipped policy's algorithm.
        elbows: elbows that it was trained with; those of `env` when None.
        env: id of the environment that it was trained in; "ElbowArm-v0" when None.
        seed: of its training; the one with the best return at its evaluation when None.

    Raises:
        ValueError: there is no such policy, or its files do not fit each other.
    """
    from safetensors.numpy import load_file

    shipped = elbows is not None or env is not None or seed is not None
    path = shipped_path(f"{source}_{task_name(env or 'ElbowArm-v0', elbows)}", seed) if shipped else Path(source)
    card_path, weights_path = pair(path)
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


def shipped_path(name: str, seed: int | None = None) -> Path:
    """Where a shipped policy of this algorithm and task stands, of the best seed unless one is given.

    Raises:
        ValueError: none is shipped.
    """
    seeds = shipped_seeds(name)
    if not seeds or seed not in (None, *seeds):
        known = sorted({path.rpartition("_seed")[0] for path in shipped_policies()})
        raise ValueError(
            f"policy must be one of {known}, got {name!r}"
            if not seeds
            else f"seed of {name} must be one of {seeds}, got {seed}"
        )

    def merit(k: int) -> float:
        card = json.loads((SHIPPED / f"{name}_seed{k}.json").read_text(encoding="utf-8"))
        return float(card["evaluation"]["return"])

    return SHIPPED / f"{name}_seed{max(seeds, key=merit) if seed is None else seed}"


def shipped_seeds(name: str) -> list[int]:
    """Training seeds of the shipped policies of an algorithm and task, such as "ppo_elbows2"."""
    stems = [path.rpartition("_seed") for path in shipped_policies()]
    return sorted(int(seed) for known, _, seed in stems if known == name)


def pair(path: Path) -> tuple[Path, Path]:
    """The card's and the weights' file of a policy named with or without either's suffix."""
    stem = path.with_suffix("") if path.suffix in (".json", ".safetensors") else path
    return stem.with_name(f"{stem.name}.json"), stem.with_name(f"{stem.name}.safetensors")


def shipped_policies() -> list[str]:
    """Names of the policies that come with the project, such as "ppo_elbows2_seed0"."""
    return sorted(path.stem for path in SHIPPED.glob("*.json"))


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

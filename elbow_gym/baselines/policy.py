"""Policies as safetensors and JSON, which run on NumPy alone and refuse an environment they were not made for."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from elbow_gym.baselines.policy_card import PolicyCard, read_card
from elbow_gym.baselines.tasks import task_name
from elbow_gym.env import ElbowArmEnv
from elbow_gym.interface import Interface
from elbow_gym.task.observation import OBSERVATION_VERSION
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv

BASELINES = Path(__file__).parent / "policies"
"""Folder of the baselines: the best training seed of each algorithm and task, ALGORITHM[_LABEL]_TASK_seedK."""
Weights = dict[str, NDArray[np.float32]]
Layer = Callable[[NDArray[np.float32]], NDArray[np.float32]]

ACTIVATIONS: dict[str, Layer] = {
    "tanh": np.tanh,
    "relu": lambda x: np.maximum(x, 0.0),
    "elu": lambda x: np.where(x > 0.0, x, np.expm1(np.minimum(x, 0.0))),
    "silu": lambda x: x * np.exp(-np.logaddexp(0.0, -x)),
}
OUTPUTS: dict[str, Layer] = {"clip": lambda x: np.clip(x, -1.0, 1.0), "tanh": np.tanh}
"""Functions that turn the last layer into an action: PPO's is clipped, SAC's squashed."""


class Policy:
    """A deterministic multilayer perceptron with SB3's `predict`.

    Args:
        card: everything about the policy but its weights.
        weights: `weight_k` (out, in) and `bias_k` (out,) of every layer k.

    Raises:
        ValueError: the card and the weights do not fit each other, a weight is not finite, or no environment has the
            card's arguments.
    """

    def __init__(self, card: PolicyCard, weights: Mapping[str, NDArray[np.floating[Any]]]) -> None:
        for name, known in (("activation", ACTIVATIONS), ("output", OUTPUTS)):
            if getattr(card, name) not in known:
                raise ValueError(f"{name} must be one of {sorted(known)}, got {getattr(card, name)!r}")
        self.weights: Weights = _checked_weights(card, weights)
        try:
            self._settings = Settings(**card.environment)
        except TypeError as error:
            raise ValueError(f"environment of the policy must be arguments of one, got {card.environment}") from error
        digest = digest_of(card, self.weights)
        if card.digest not in ("", digest):
            raise ValueError(f"weights and card must be those of the digest {card.digest}, got {digest}")
        self.card = replace(card, digest=digest)

    def check(self, env: Any) -> None:
        """Raises ValueError when an environment's observation or action is not the one of the training.

        Args:
            env: an environment of this package, single or batched, also under wrappers, `SB3VecEnv` or a vector
                environment that holds its parts in this process.
        """
        if self.card.observation_version != OBSERVATION_VERSION:
            raise ValueError(
                f"observation_version of the policy must be {OBSERVATION_VERSION}, got {self.card.observation_version}"
            )
        interface = Interface(_own_environment(env))
        names = interface.layout.names
        if self.card.observation != names:
            raise ValueError(
                f"observation of the policy must be the environment's {names}, got {self.card.observation}"
            )
        trained_in = self.settings
        for name in ("elbow_joints", "action_unit", "voltage_limit", "control_frequency"):
            trained, found = getattr(trained_in, name), getattr(interface.settings, name)
            if trained != found:
                raise ValueError(f"{name} of the environment must be {trained!r} as in training, got {found!r}")

    def acting_in(self, env: Any) -> Policy:
        """This policy as the controller of an environment. Argument and errors of `check`."""
        self.check(env)
        return self

    @property
    def settings(self) -> Settings:
        """Settings of the environment in training."""
        return self._settings

    def predict(
        self, observation: NDArray[np.float32], *_args: Any, **_kwargs: Any
    ) -> tuple[NDArray[np.float32], None]:
        """Actions (..., n) in [-1, 1] for observations (..., size).

        Raises:
            ValueError: observations have another size, are not finite, or are so large that float32 overflows.
        """
        x = np.asarray(observation, dtype=np.float32)
        if x.ndim == 0 or x.shape[-1] != self.card.layers[0]:
            got = x.shape[-1] if x.ndim else "a scalar"
            raise ValueError(f"observation must have {self.card.layers[0]} entries, got {got}")
        if not np.isfinite(x).all():
            raise ValueError(f"observation must be finite, got {x[~np.isfinite(x)][0]}")
        activation, last = ACTIVATIONS[self.card.activation], len(self.card.layers) - 2
        with np.errstate(over="ignore", invalid="ignore"):
            for k in range(last + 1):
                x = x @ self.weights[f"weight_{k}"].T + self.weights[f"bias_{k}"]
                x = activation(x) if k < last else x
            action = OUTPUTS[self.card.output](x).astype(np.float32, copy=False)
        if np.isnan(action).any():
            raise ValueError(f"observation must not overflow float32, got {np.abs(observation).max()} in it")
        return action, None

    def module(self) -> Any:
        """The network as a `torch.nn.Sequential` that maps observations to actions, to train further."""
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


def digest_of(card: PolicyCard, weights: Mapping[str, NDArray[np.float32]]) -> str:
    """SHA-256 of the card's deciding entries and of the weights, name by name."""
    digest = hashlib.sha256(card.deciding.encode())
    for name in sorted(weights):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(weights[name], dtype="<f4").tobytes())
    return digest.hexdigest()


def _checked_weights(card: PolicyCard, weights: Mapping[str, NDArray[np.floating[Any]]]) -> Weights:
    """Float32 weights in C order, as files hold them. Raises ValueError naming a weight that does not fit the card."""
    checked: Weights = {}
    for k, (size, after) in enumerate(zip(card.layers[:-1], card.layers[1:], strict=True)):
        for name, shape in ((f"weight_{k}", (after, size)), (f"bias_{k}", (after,))):
            if name not in weights or weights[name].shape != shape:
                got = weights[name].shape if name in weights else "nothing"
                raise ValueError(f"{name} must have shape {shape}, got {got}")
            if weights[name].dtype.kind != "f":
                raise ValueError(f"{name} must be floating-point numbers, got {weights[name].dtype}")
            checked[name] = np.array(weights[name], dtype=np.float32, order="C")
            if not np.isfinite(checked[name]).all():
                raise ValueError(f"{name} must be finite, got {checked[name][~np.isfinite(checked[name])][0]}")
    if more := sorted(set(weights) - set(checked)):
        raise ValueError(f"weights must be those of {len(card.layers) - 1} layers, got {more[0]!r}, too")
    return checked


def _own_environment(env: Any) -> ElbowArmEnv | ElbowArmVectorEnv:
    """The environment of this package under wrappers, adapters and vector environments of this process."""
    found = env
    while not isinstance(found, (ElbowArmEnv, ElbowArmVectorEnv)):
        # Wrappers and SB3VecEnv hold the next one as `env`, SB3's wrappers as `venv`, vector environments as `envs`.
        parts = (*(getattr(found, name, None) for name in ("env", "venv")), *(getattr(found, "envs", None) or ())[:1])
        found = next((part for part in parts if part is not None), None)
        if found is None:
            raise ValueError(f"env must hold an environment of elbow_gym in this process, got {env}")
    return found


def load_policy(source: str | Path, elbows: int | None = None, env: str | None = None) -> Policy:
    """A policy from a file, or a baseline: `load_policy("ppo", elbows=2)`, `load_policy("ppo", env="...")`.

    Args:
        source: a path with or without suffix; with `elbows` or `env` a baseline's algorithm.
        elbows: number of elbows in training; that of `env` when None.
        env: id of the environment in training; "ElbowArm-v0" when None.

    Raises:
        ValueError: there is no such policy, or its files do not fit each other.
    """
    if elbows is None and env is None:
        counts = sorted(
            name.removeprefix(f"{source}_elbows") for name in baseline_names() if f"{source}_elbows" in name
        )
        if counts and not pair(Path(source))[0].is_file():
            known = f"elbows={' or elbows='.join(counts)}"
            raise ValueError(
                f"elbows or env must be given for the baselines {str(source)!r}, such as {known}, got neither"
            )
        return read_policy(Path(source))
    return read_policy(baseline_path(f"{source}_{task_name(env or 'ElbowArm-v0', elbows)}"))


def read_policy(path: Path) -> Policy:
    """The policy in a pair of files, named with or without either's suffix.

    Raises:
        ValueError: a file is missing, cut or altered, or they do not fit each other.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load_file  # pyright: ignore[reportUnknownVariableType]

    card_path, weights_path = pair(path)
    for needed in (card_path, weights_path):
        if not needed.is_file():
            raise ValueError(
                f"policy must be one of {baseline_names()} or the path of a pair of files, got no {needed}"
            )
    card = read_card(card_path)
    try:
        weights = cast("Weights", load_file(weights_path))
    # safetensors' own error, and those of a header that names what NumPy lacks.
    except (SafetensorError, KeyError, ValueError, TypeError, AttributeError) as error:
        raise ValueError(f"policy weights must be whole safetensors, got {weights_path}: {error}") from error
    return Policy(card, weights)


def baseline_names() -> list[str]:
    """Names of the baselines without their training seeds, such as "ppo_elbows2"."""
    return sorted(path.stem.rpartition("_seed")[0] for path in BASELINES.glob("*_seed*.json"))


def baseline_path(name: str) -> Path:
    """The baseline of an algorithm and task, such as "ppo_elbows2", without suffix. ValueError when there is none."""
    found = sorted(BASELINES.glob(f"{name}_seed*.json"))
    if not found:
        raise ValueError(f"policy must be one of {baseline_names()}, got {name!r}")
    return found[0].with_suffix("")


def pair(path: Path) -> tuple[Path, Path]:
    """The card's and the weights' file of a policy named with or without either's suffix."""
    stem = path.with_suffix("") if path.suffix in (".json", ".safetensors") else path
    return stem.with_name(f"{stem.name}.json"), stem.with_name(f"{stem.name}.safetensors")

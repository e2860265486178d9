"""Policies as ONNX files: read by ONNX Runtime as controllers, written with a contract beside them."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.files import write_text, write_whole
from elbow_gym.baselines.policy import Policy
from elbow_gym.interface import Environment, Interface
from elbow_gym.task.observation import OBSERVATION_VERSION
from elbow_gym.vector_env import ElbowArmVectorEnv

OPSET = 17
"""Version of ONNX's operators that files are written in."""
TOLERANCE = 1e-6
"""Largest difference between the actions of a policy and of its file, as a share of an action's bound [-]."""
TRIALS = 256
"""Number of observations at which they are compared."""
OPERATORS = {"tanh": "Tanh", "relu": "Relu", "elu": "Elu"}
"""ONNX's operators by the name of an activation; "silu" is made of two."""


def contract_path(path: Path) -> Path:
    """File of the contract beside an ONNX file: NAME.onnx.json."""
    return path.with_name(f"{path.name}.json")


def contract_of(path: Path) -> dict[str, Any] | None:
    """Arguments of the environment in the contract beside an ONNX file; None without a contract.

    Raises:
        ValueError: the contract is damaged.
    """
    try:
        return json.loads(contract_path(path).read_text(encoding="utf-8"))["environment"]
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{contract_path(path)} must hold a JSON object with environment, got: {error!r}") from error


class OnnxModel:
    """Controller in an ONNX file with one input, observations (B, size), and actions (B, n) as its first output.

    Args:
        path: the file.
        env: the environment that it will act in.

    Raises:
        ValueError: the file is no ONNX model, or does not fit the environment or its own contract.
        DependencyNotInstalled: ONNX Runtime is missing.
    """

    def __init__(self, path: Path, env: Environment) -> None:
        runtime = _library("onnxruntime")
        options = runtime.SessionOptions()
        # One thread: the same sums in the same order on every machine.
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        try:
            self._session = runtime.InferenceSession(path.read_bytes(), options, providers=["CPUExecutionProvider"])
        # ONNX Runtime's errors have no common class of their own.
        except Exception as error:
            raise ValueError(f"{path} must be an ONNX model, got: {error}") from error
        inputs = self._session.get_inputs()
        size = Interface(env).layout.size
        if len(inputs) != 1 or len(inputs[0].shape) != 2 or inputs[0].shape[1] not in (size, None):
            got = [one.shape for one in inputs]
            raise ValueError(f"{path} must have one input (B, {size}), as the environment's observation, got {got}")
        self._name, self._alone = inputs[0].name, inputs[0].shape[0] == 1
        if contract_path(path).is_file():
            _check_contract(path, Interface(env))

    def predict(self, observation: NDArray[np.float32], *_args: Any, **_kwargs: Any) -> tuple[Any, None]:
        """Actions (B, n) for observations (B, size), or (n,) for one of (size,)."""
        rows = np.atleast_2d(np.asarray(observation, dtype=np.float32))
        parts = [rows[k : k + 1] for k in range(len(rows))] if self._alone else [rows]
        action = np.concatenate([self._session.run(None, {self._name: part})[0] for part in parts])
        return action if np.ndim(observation) > 1 else action[0], None


def _check_contract(path: Path, interface: Interface) -> None:
    """Raises ValueError naming the first entry of a contract that the environment does not meet."""
    written = json.loads(contract_path(path).read_text(encoding="utf-8"))
    for name, own in _duties(interface).items():
        told = written.get(name)
        if told == own:
            continue
        both = [(told, own)]
        if isinstance(told, list) and isinstance(own, list) and len(told) == len(own):
            # The first entry that differs says more than all of them.
            both = [pair for pair in zip(told, own, strict=True) if pair[0] != pair[1]]
        raise ValueError(f"{name} of the environment must be {both[0][0]} as in {path}.json, got {both[0][1]}")


def _duties(interface: Interface) -> dict[str, Any]:
    """Entries of a contract that every environment which the policy acts in must meet, JSON types only."""
    layout, settings = interface.layout, interface.settings
    limits = np.repeat([feature.limit for feature in layout.features], layout.sizes)
    entries = zip(layout.names, layout.scale.tolist(), limits.tolist(), strict=True)
    return {
        "observation_version": OBSERVATION_VERSION,
        "observation": [{"name": name, "scale": scale, "limit": limit} for name, scale, limit in entries],
        "action": {"unit": settings.action_unit, "low": -interface.highest_action, "high": interface.highest_action},
        "control_frequency": settings.control_frequency,
        "voltage_limit": settings.voltage_limit,
        "elbow_joints": list(interface.elbows),
    }


def write_onnx(policy: Policy, path: Path) -> float:
    """Writes a policy as `path`, and its contract as `path`.json; nothing unless both give the same actions.

    The contract names every entry of the observation with its scale and limit, the action's unit and bounds, the rate,
    the supply, the elbows and the arguments of the environment in training.

    Returns:
        The largest difference between the policy's actions and the file's at random observations [-].

    Raises:
        ValueError: the suffix is not .onnx, or the difference exceeds `TOLERANCE`.
        DependencyNotInstalled: onnx or ONNX Runtime is missing.
    """
    if path.suffix != ".onnx":
        raise ValueError(f"output must end in .onnx, got {path.name!r}")
    env = ElbowArmVectorEnv(1, **policy.card.environment)
    interface = Interface(env)
    contract = {
        **_duties(interface),
        "algorithm": policy.card.algorithm,
        "env": policy.card.env,
        "environment": policy.card.environment,
        "digest": policy.card.digest,
    }
    content = _model(policy).SerializeToString()
    size = interface.layout.size
    observation = np.random.default_rng(0).normal(size=(TRIALS, size)).astype(np.float32)
    session = _library("onnxruntime").InferenceSession(content, providers=["CPUExecutionProvider"])
    difference = float(
        np.abs(session.run(None, {"observation": observation})[0] - policy.predict(observation)[0]).max()
    )
    if not difference <= TOLERANCE:
        raise ValueError(f"actions of {path} must be the policy's to {TOLERANCE:g}, got a difference of {difference:g}")
    write_text(contract_path(path), json.dumps(contract, indent=2) + "\n")
    write_whole(path, lambda temporary: temporary.write_bytes(content))
    return difference


def _model(policy: Policy) -> Any:
    """The policy as an ONNX model: a Gemm and an activation for each layer."""
    onnx = _library("onnx")
    card, helper = policy.card, onnx.helper
    last, nodes, value = len(card.layers) - 2, [], "observation"
    for k in range(last + 1):
        nodes.append(helper.make_node("Gemm", [value, f"weight_{k}", f"bias_{k}"], [f"sum_{k}"], transB=1))
        value = f"sum_{k}"
        if k < last and card.activation == "silu":
            nodes.append(helper.make_node("Sigmoid", [value], [f"gate_{k}"]))
            nodes.append(helper.make_node("Mul", [value, f"gate_{k}"], [f"layer_{k}"]))
        elif k < last:
            nodes.append(helper.make_node(OPERATORS[card.activation], [value], [f"layer_{k}"]))
        value = f"layer_{k}" if k < last else value
    weights = [onnx.numpy_helper.from_array(array, name) for name, array in policy.weights.items()]
    if card.output == "tanh":
        nodes.append(helper.make_node("Tanh", [value], ["action"]))
    else:
        nodes.append(helper.make_node("Clip", [value, "low", "high"], ["action"]))
        weights += [onnx.numpy_helper.from_array(np.float32(end), name) for name, end in (("low", -1), ("high", 1))]
    kind = onnx.TensorProto.FLOAT
    graph = helper.make_graph(
        nodes,
        card.algorithm,
        [helper.make_tensor_value_info("observation", kind, ["batch", card.layers[0]])],
        [helper.make_tensor_value_info("action", kind, ["batch", card.layers[-1]])],
        weights,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)
    onnx.checker.check_model(model)
    return model


def _library(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError as error:
        from gymnasium.error import DependencyNotInstalled

        raise DependencyNotInstalled(f'{name} is missing: pip install -e ".[onnx]" ({error})') from error

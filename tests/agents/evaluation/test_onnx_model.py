"""Policies as ONNX files: what is written acts as the policy, and a contract is kept."""

import json
from dataclasses import replace

import numpy as np
import pytest

from agents.evaluation.onnx_model import TOLERANCE, OnnxModel, contract_of, contract_path, write_onnx
from agents.evaluation.players import find_player
from agents.learning.export import export
from agents.shipped.seeds import load_policy
from agents.task_options import TaskOptions
from elbow_gym.baselines.policy import Policy
from elbow_gym.vector_env import ElbowArmVectorEnv

pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("onnx") / "policy.onnx"
    return load_policy("ppo", elbows=1), path, write_onnx(load_policy("ppo", elbows=1), path)


def test_file_acts_as_the_policy_on_states_of_the_task(written):
    policy, path, difference = written
    assert difference <= TOLERANCE
    env = ElbowArmVectorEnv(3, elbows=1)
    model = OnnxModel(path, env)
    observation, _ = env.reset(seed=0)
    for _ in range(20):
        action, _ = model.predict(observation)
        np.testing.assert_allclose(action, policy.predict(observation)[0], atol=TOLERANCE)
        observation = env.step(action)[0]
    assert model.predict(observation[0])[0].shape == (10,)


@pytest.mark.parametrize("activation", ["tanh", "relu", "elu", "silu"])
@pytest.mark.parametrize("output", ["clip", "tanh"])
def test_every_activation_and_output_is_written(tmp_path, activation, output):
    shipped = load_policy("ppo", elbows=2)
    card = replace(shipped.card, activation=activation, output=output, digest="")
    assert write_onnx(Policy(card, shipped.weights), tmp_path / "policy.onnx") <= TOLERANCE


def test_contract_says_what_the_policy_needs_and_brings_its_environment(written):
    policy, path, _ = written
    contract = json.loads(contract_path(path).read_text())
    assert contract["observation"][0] == {"name": "joint_angle_1 [rad]", "scale": 0.3, "limit": 10.0}
    assert tuple(entry["name"] for entry in contract["observation"]) == policy.card.observation
    assert contract["action"] == {"unit": "fraction", "low": -1.0, "high": 1.0}
    assert (contract["control_frequency"], contract["voltage_limit"], contract["elbow_joints"]) == (50.0, 24.0, [4])
    assert (contract["env"], contract["digest"]) == ("ElbowArm-v0", policy.card.digest)
    player = find_player(f"mine={path}")
    assert (player.name, player.settings.elbows) == ("mine", 1)
    with pytest.raises(ValueError, match=r"^elbows must be 1 as in the policy's training, got 2"):
        find_player(str(path), 2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"elbows": 2}, r"elbow_joints of the environment must be \[4\] as in .*, got \[4, 7\]"),
        ({"elbows": 1, "control_frequency": 100.0}, "control_frequency of the environment must be 50.0 as in .* 100.0"),
        ({"elbows": 1, "action_unit": "volt"}, "action of the environment must be .*fraction.* as in .*volt"),
        ({"elbows": 1, "heat": True}, r"must have one input \(B, 51\), as the environment's observation, got .*41"),
    ],
)
def test_environment_that_breaks_the_contract_is_refused_by_its_entry(written, arguments, message):
    with pytest.raises(ValueError, match=message):
        OnnxModel(written[1], ElbowArmVectorEnv(1, **arguments))


def test_file_of_something_else_and_damaged_contract_are_named(tmp_path):
    path = tmp_path / "policy.onnx"
    path.write_bytes(b"no model")
    with pytest.raises(ValueError, match=rf"^{path} must be an ONNX model, got: "):
        OnnxModel(path, ElbowArmVectorEnv(1))
    assert contract_of(path) is None
    contract_path(path).write_text("{")
    with pytest.raises(ValueError, match=r"policy.onnx.json must hold a JSON object with environment"):
        contract_of(path)


def test_model_of_one_observation_plays_a_batch_row_by_row(tmp_path):
    import onnx

    path = tmp_path / "policy.onnx"
    write_onnx(load_policy("ppo", elbows=2), path)
    contract_path(path).unlink()
    model = onnx.load(path)
    model.graph.input[0].type.tensor_type.shape.dim[0].dim_value = 1
    model.graph.output[0].type.tensor_type.shape.dim[0].dim_value = 1
    onnx.save(model, path)
    env = ElbowArmVectorEnv(3)
    observation, _ = env.reset(seed=0)
    expected = load_policy("ppo", elbows=2).predict(observation)[0]
    np.testing.assert_allclose(OnnxModel(path, env).predict(observation)[0], expected, atol=TOLERANCE)


def test_output_with_another_suffix_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"^output must end in .onnx, got 'policy.pt'"):
        write_onnx(load_policy("ppo", elbows=2), tmp_path / "policy.pt")


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["PPO", "A2C", "SAC", "TD3"])
def test_model_of_stable_baselines3_is_exported(algorithm, tmp_path):
    sb3 = pytest.importorskip("stable_baselines3")
    from elbow_gym.sb3 import SB3VecEnv

    env = SB3VecEnv(ElbowArmVectorEnv(2, autoreset_mode="SameStep"))
    model = getattr(sb3, algorithm)("MlpPolicy", env, seed=1, policy_kwargs={"net_arch": [8]}, device="cpu")
    model.save(tmp_path / "model")
    said = export(str(tmp_path / "model.zip"), tmp_path / "model.onnx", TaskOptions(elbows=2), trust=True)
    assert "model.onnx and model.onnx.json: actions differ" in said
    observation = env.reset()
    action = OnnxModel(tmp_path / "model.onnx", ElbowArmVectorEnv(2)).predict(observation)[0]
    np.testing.assert_allclose(action, model.predict(observation, deterministic=True)[0], atol=TOLERANCE)
    with pytest.raises(ValueError, match=r"^--trust must be given for "):
        export(str(tmp_path / "model.zip"), tmp_path / "model.onnx", TaskOptions(elbows=2), trust=False)

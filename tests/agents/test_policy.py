"""Policies: files that never unpickle, an actor equal to SB3's, and refusals that say why."""

import hashlib
import json
import re
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import RescaleAction

pytest.importorskip("stable_baselines3")

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecFrameStack, VecMonitor, VecNormalize

import agents.pd
import elbow_gym
from agents.learning.actor import policy_of, save_policy
from agents.learning.sac.settings import SACSettings
from agents.shipped import seeds as shipped
from agents.shipped.seeds import load_policy
from elbow_gym.baselines import policy as baselines
from elbow_gym.baselines.policy import Policy, read_policy
from elbow_gym.env import ElbowArmEnv
from elbow_gym.sb3 import SB3VecEnv
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv


@pytest.fixture(scope="module")
def model():
    arms = SB3VecEnv(ElbowArmVectorEnv(2, autoreset_mode="SameStep"))
    kwargs = {"net_arch": [8, 8], "activation_fn": torch.nn.Tanh, "log_std_init": -1.5}
    return PPO("MlpPolicy", arms, n_steps=4, batch_size=8, policy_kwargs=kwargs, seed=0, device="cpu")


@pytest.fixture
def policy(model):
    return policy_of(model, Settings(), command="test")


def changed(policy, **entries):
    """The card with other entries, and the digest still to be found."""
    return replace(policy.card, digest="", **entries)


def test_policy_acts_as_the_model_that_it_came_from(model, policy):
    observation = np.random.default_rng(0).normal(size=(7, policy.card.layers[0])).astype(np.float32)
    expected, _ = model.predict(observation, deterministic=True)
    np.testing.assert_allclose(policy.predict(observation)[0], expected, atol=1e-6)
    np.testing.assert_allclose(policy.predict(observation[0])[0], expected[0], atol=1e-6)


def trained(wrapped):
    """A model whose environment has been played in, so that a normaliser of observations has statistics."""
    kwargs = {"net_arch": [8, 8], "activation_fn": torch.nn.Tanh}
    model = PPO("MlpPolicy", wrapped, n_steps=50, batch_size=100, policy_kwargs=kwargs, seed=0, device="cpu")
    return model.learn(100)


def plain_arms():
    return SB3VecEnv(ElbowArmVectorEnv(2, circle={"phase": "random"}, autoreset_mode="SameStep"))


def test_policy_of_a_model_behind_vec_normalize_takes_plain_observations():
    normaliser = VecNormalize(VecMonitor(plain_arms()))
    model = trained(normaliser)
    policy = policy_of(model, Settings(), command="test")
    normaliser.training = False
    observation = normaliser.reset()
    for _ in range(20):
        plain = normaliser.get_original_obs()
        assert np.abs(observation).max() < normaliser.clip_obs
        expected, _ = model.predict(observation, deterministic=True)
        np.testing.assert_allclose(policy.predict(plain)[0], expected, atol=2e-5)
        observation, *_ = normaliser.step(expected)
    assert np.abs(observation - normaliser.get_original_obs()).max() > 0.5


def test_policy_of_a_model_with_normalised_rewards_alone_is_the_models():
    model = trained(VecNormalize(plain_arms(), norm_obs=False))
    observation = model.get_env().reset()
    expected, _ = model.predict(observation, deterministic=True)
    policy = policy_of(model, Settings(), command="test")
    np.testing.assert_allclose(policy.predict(observation)[0], expected, atol=1e-6)


def test_policy_of_a_model_whose_observations_never_varied_is_refused():
    model = trained(VecNormalize(plain_arms()))
    model.get_vec_normalize_env().obs_rms.var[3] = 0.0
    with pytest.raises(ValueError, match=r"must have varied in training, got constant \['joint_angle_4 \[rad\]'\]$"):
        policy_of(model, Settings(), command="test")


@pytest.mark.parametrize(
    ("wrapped", "name"),
    [
        (lambda: VecFrameStack(plain_arms(), 2), "VecFrameStack"),
        (lambda: DummyVecEnv([lambda: RescaleAction(ElbowArmEnv(), np.float32(-2), np.float32(2))]), "ActionWrapper"),
    ],
)
def test_policy_of_a_model_behind_other_wrappers_is_refused_by_name(wrapped, name):
    env = wrapped()
    model = PPO("MlpPolicy", env, n_steps=4, batch_size=4, policy_kwargs={"net_arch": [8]}, device="cpu")
    with pytest.raises(ValueError, match=f"^model must be trained on the environment's own .*, got {name}$"):
        policy_of(model, Settings(), command="test")


@pytest.mark.parametrize(
    ("activation", "output"), [("tanh", "clip"), ("relu", "tanh"), ("elu", "clip"), ("silu", "clip")]
)
def test_torch_form_acts_as_the_numpy_one(policy, activation, output):
    other = Policy(changed(policy, activation=activation, output=output), policy.weights)
    observation = np.random.default_rng(1).normal(size=(9, policy.card.layers[0]), scale=30.0).astype(np.float32)
    with torch.no_grad():
        expected = other.module()(torch.from_numpy(observation)).numpy()
    np.testing.assert_allclose(other.predict(observation)[0], expected, atol=1e-6)


@pytest.mark.parametrize("use_sde", [False, True])
def test_squashed_actor_acts_as_the_model_that_it_came_from(use_sde, tmp_path):
    env = {"elbows": 0, "table": True}
    settings = Settings(**env)
    arms = SB3VecEnv(ElbowArmVectorEnv(2, **env, autoreset_mode="SameStep"))
    model = SACSettings(hidden=(8, 8), buffer_size=10, use_sde=use_sde).model(arms, 0, tmp_path)
    with torch.no_grad():
        model.actor.mu.weight.mul_(3000.0)
    # Half of the way, so that what is played differs from the actor.
    model.policy.follow(0.0, 0.5)
    squashed = policy_of(model, settings, command="test")
    squashed.check(ElbowArmEnv(**env))
    observation = np.random.default_rng(0).normal(size=(7, squashed.card.layers[0])).astype(np.float32)
    expected, _ = model.predict(observation, deterministic=True)
    assert np.abs(expected).max() > 0.9
    np.testing.assert_allclose(squashed.predict(observation)[0], expected, atol=1e-6)
    with pytest.raises(ValueError, match="observation of the policy must be"):
        squashed.check(ElbowArmEnv())


def test_weights_of_another_card_are_refused(policy):
    other = {name: weights + 1.0 for name, weights in policy.weights.items()}
    with pytest.raises(ValueError, match="weights and card must be those of the digest"):
        Policy(policy.card, other)


@pytest.mark.parametrize(
    "entry",
    [
        {"activation": "elu"},
        {"output": "tanh"},
        {"env": "ElbowArmTable-v0"},
        {"environment": {"voltage_limit": 12.0}},
        {"environment": {"action_unit": "volt"}},
        {"observation_version": 0},
        {"observation": ("other [-]",)},
    ],
    ids=lambda entry: next(iter(entry)),
)
def test_card_that_was_altered_where_it_decides_what_the_policy_does_is_refused(policy, entry, tmp_path):
    save_policy(policy, tmp_path / "p")
    plain = json.loads((tmp_path / "p.json").read_text())
    (tmp_path / "p.json").write_text(json.dumps(plain | entry))
    with pytest.raises(ValueError, match="weights and card must be those of the digest"):
        load_policy(tmp_path / "p")


def test_account_of_how_the_policy_came_about_may_change(policy, tmp_path):
    save_policy(policy, tmp_path / "p")
    plain = json.loads((tmp_path / "p.json").read_text())
    (tmp_path / "p.json").write_text(json.dumps(plain | {"command": "another", "training": {"seed": 7}}))
    assert load_policy(tmp_path / "p").card.digest == policy.card.digest


def test_weights_that_are_not_contiguous_or_of_double_precision_are_saved_as_float32_in_c_order(policy, tmp_path):
    turned = {name: np.asfortranarray(weights).astype(np.float64) for name, weights in policy.weights.items()}
    assert not turned["weight_0"].flags.c_contiguous
    save_policy(Policy(policy.card, turned), tmp_path / "p")
    back = load_policy(tmp_path / "p")
    for name, weights in policy.weights.items():
        np.testing.assert_array_equal(back.weights[name], weights)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_weights_that_are_not_finite_are_refused(policy, value):
    weights = {name: array.copy() for name, array in policy.weights.items()}
    weights["bias_1"][2] = value
    with pytest.raises(ValueError, match=f"bias_1 must be finite, got {value}"):
        Policy(changed(policy), weights)


@pytest.mark.parametrize("end", ["json", "safetensors"])
def test_files_that_were_cut_or_flipped_anywhere_are_refused_by_name(policy, tmp_path, end):
    save_policy(policy, tmp_path / "p")
    path, rng, refusals = tmp_path / f"p.{end}", np.random.default_rng(0), []
    whole = path.read_bytes()
    account = whole.find(b'"training"') if end == "json" else len(whole)
    for place in [0, 1, 8, *rng.integers(account, size=60)]:
        path.write_bytes(whole[:place])
        with pytest.raises(ValueError, match=r"^policy (card|weights) must"):
            load_policy(tmp_path / "p")
        flipped = bytearray(whole)
        flipped[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        try:
            digest = load_policy(tmp_path / "p").card.digest
        except ValueError as refusal:
            refusals.append(str(refusal))
        else:
            # A flip inside the account, such as the algorithm's name, decides nothing.
            assert digest == policy.card.digest
    assert all(re.search(r"must .*got", refusal, re.DOTALL) for refusal in refusals)
    assert len(refusals) > 40


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"activation": ["silu"]}, "activation of a policy card must be a text"),
        ({"layers": ["8", 8]}, "layers of a policy card must be at least two positive integers"),
        ({"layers": [8]}, "layers of a policy card must be at least two positive integers"),
        ({"observation": [1]}, "observation of a policy card must be names"),
        ({"environment": []}, "environment of a policy card must be an object"),
        ({"environment": {"wind": 1}}, "environment of the policy must be arguments of one"),
        ({"format": 1}, "format of the policy must be 2, got 1"),
        ({"wind": 1}, "unknown entry 'wind'"),
    ],
)
def test_entries_of_another_type_are_refused_by_name(policy, tmp_path, entry, message):
    save_policy(policy, tmp_path / "p")
    plain = json.loads((tmp_path / "p.json").read_text())
    (tmp_path / "p.json").write_text(json.dumps(plain | entry))
    with pytest.raises(ValueError, match=message):
        load_policy(tmp_path / "p")


@pytest.mark.parametrize(
    ("observation", "message"),
    [
        (np.nan, "observation must be finite, got nan"),
        (-np.inf, "observation must be finite, got -inf"),
        (3e38, "observation must not overflow float32"),
    ],
)
def test_observations_that_are_not_finite_or_overflow_raise(policy, observation, message):
    weights = {name: 9.0 * np.sign(array + 0.01) for name, array in policy.weights.items()}
    weights["weight_0"][:, ::2] *= -1.0
    large = Policy(changed(policy, activation="relu"), weights)
    with pytest.raises(ValueError, match=message):
        large.predict(np.full((2, policy.card.layers[0]), observation, np.float32))
    with pytest.raises(ValueError, match="observation must have 41 entries, got a scalar"):
        policy.predict(np.float32(0.0))


def test_policy_is_checked_under_wrappers_adapters_and_vector_environments(policy):
    def batch(**arguments):
        return ElbowArmVectorEnv(2, **arguments, autoreset_mode="SameStep")

    makers = [
        lambda **arguments: SB3VecEnv(batch(**arguments)),
        lambda **arguments: VecMonitor(SB3VecEnv(batch(**arguments))),
        lambda **arguments: gym.make("ElbowArm-v0", **arguments),
        lambda **arguments: gym.make_vec("ElbowArm-v0", 2, vectorization_mode="sync", **arguments),
        lambda **arguments: DummyVecEnv([lambda: ElbowArmEnv(**arguments)]),
        batch,
    ]
    for make in makers:
        assert policy.acting_in(make()) is policy
        with pytest.raises(ValueError, match=r"elbow_joints of the environment must be \(4, 7\) as in training, got"):
            policy.check(make(elbows=1))
    with pytest.raises(ValueError, match="env must hold an environment of elbow_gym in this process, got 3"):
        policy.check(3)


def test_shipped_weights_are_those_that_were_trained():
    trained = json.loads((Path(__file__).parents[1] / "vectors" / "policy_weights.json").read_text())
    for name, digest in trained.items():
        group, _, seed = name.rpartition("_seed")
        found = hashlib.sha256()
        for entry, weights in sorted(read_policy(shipped.shipped_path(group, int(seed))).weights.items()):
            found.update(entry.encode() + weights.tobytes())
        assert found.hexdigest() == digest, name


def test_saved_policy_comes_back_bit_for_bit(policy, tmp_path):
    save_policy(policy, tmp_path / "p")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["p.json", "p.safetensors"]
    back = load_policy(tmp_path / "p")
    assert back.card == policy.card
    for name, weights in policy.weights.items():
        np.testing.assert_array_equal(back.weights[name], weights)


def test_interrupted_save_leaves_the_old_policy(policy, tmp_path, monkeypatch):
    save_policy(policy, tmp_path / "p")
    before = (tmp_path / "p.safetensors").read_bytes()
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        save_policy(policy, tmp_path / "p")
    assert (tmp_path / "p.safetensors").read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    ("env", "message"),
    [
        ({"elbows": 1}, r"elbow_joints of the environment must be \(4, 7\) as in training, got \(4,\)"),
        ({"voltage_limit": 12.0}, r"voltage_limit of the environment must be 24.0 as in training, got 12.0"),
        ({"control_frequency": 100.0}, r"control_frequency of the environment must be 50.0 .* got 100.0"),
        ({"action_unit": "volt"}, r"action_unit of the environment must be 'fraction' .* got 'volt'"),
    ],
)
def test_policy_refuses_another_environment(policy, env, message):
    policy.check(ElbowArmEnv())
    with pytest.raises(ValueError, match=message):
        policy.check(ElbowArmEnv(**env))


def test_policy_refuses_another_observation(policy):
    for card, message in (
        (changed(policy, observation_version=0), "observation_version of the policy must be"),
        (changed(policy, observation=policy.card.observation[::-1]), "observation of the policy must be"),
    ):
        with pytest.raises(ValueError, match=message):
            Policy(card, policy.weights).check(ElbowArmEnv())
    with pytest.raises(ValueError, match=r"observation must have \d+ entries, got 3"):
        policy.predict(np.zeros(3, np.float32))


def test_bundle_that_does_not_fit_is_refused(policy, tmp_path):
    with pytest.raises(ValueError, match=r"weight_0 must have shape \(8, \d+\), got nothing"):
        Policy(policy.card, {})
    with pytest.raises(ValueError, match="activation must be one of"):
        Policy(changed(policy, activation="sine"), policy.weights)
    with pytest.raises(ValueError, match="format of the policy must be 2, got 7"):
        replace(policy.card, format=7)
    with pytest.raises(ValueError, match=r"weights must be those of 3 layers, got 'weight_9', too"):
        Policy(policy.card, {**policy.weights, "weight_9": policy.weights["weight_0"]})
    needed = (
        r"^elbows or env must be given for the baselines 'ppo', such as elbows=0 or elbows=1 or elbows=2, got neither$"
    )
    for load in (load_policy, elbow_gym.load_policy):
        with pytest.raises(ValueError, match=needed):
            load("ppo")
    with pytest.raises(ValueError, match=r"policy must be one of .*got no"):
        load_policy(tmp_path / "nothing")
    save_policy(policy, tmp_path / "p")
    (tmp_path / "p.json").write_text(json.dumps({"algorithm": "ppo"}))
    with pytest.raises(ValueError, match="policy card must hold the fields of PolicyCard"):
        load_policy(tmp_path / "p")


def test_package_and_agents_load_the_same_baseline():
    for arguments in ({"elbows": 2}, {"env": "ElbowArmTable-v0"}):
        assert elbow_gym.load_policy("ppo", **arguments).card == load_policy("ppo", **arguments).card
    assert elbow_gym.load_policy("ppo", elbows=2).card.training["seed"] == 2
    assert agents.load_policy is load_policy
    assert agents.pd.PDController is elbow_gym.PDController


def test_baseline_is_loaded_unless_a_seed_is_given(policy, tmp_path, monkeypatch):
    best, others = tmp_path / "best", tmp_path / "others"
    for module, name, folder in (
        (baselines, "BASELINES", best),
        (shipped, "BASELINES", best),
        (shipped, "POLICIES", others),
    ):
        monkeypatch.setattr(module, name, folder)
    for seed, merit, folder in ((0, -40.0, others), (3, -30.0, best), (10, -35.0, others)):
        save_policy(
            Policy(replace(policy.card, evaluation={"return": merit}), policy.weights), folder / f"ppo_table_seed{seed}"
        )
    assert shipped.shipped_seeds("ppo_table") == [0, 3, 10]
    assert load_policy("ppo", env="ElbowArmTable-v0").card.evaluation["return"] == -30.0
    for seed, merit in ((3, -30.0), (10, -35.0)):
        assert load_policy("ppo", env="ElbowArmTable-v0", seed=seed).card.evaluation["return"] == merit
    with pytest.raises(ValueError, match=r"seed of ppo_table must be one of \[0, 3, 10\], got 1"):
        load_policy("ppo", env="ElbowArmTable-v0", seed=1)
    for seed in (None, 0):
        with pytest.raises(ValueError, match=r"policy must be one of \['ppo_table'\], got 'sac_elbows1'"):
            load_policy("sac", elbows=1, seed=seed)
    with pytest.raises(ValueError, match=r"env must be one of .*, got 'Pendulum-v1'"):
        load_policy("ppo", env="Pendulum-v1")

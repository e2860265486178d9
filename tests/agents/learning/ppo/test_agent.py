"""The PPO: the updates and rollouts of Stable-Baselines3's, up to rounding."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import stable_baselines3
import torch

from agents.learning.flat_adam import FlatAdam
from agents.learning.passes import outputs_of
from agents.learning.ppo.agent import PPO
from agents.learning.ppo.gradient import compile_loops, gradient_of
from elbow_gym.sb3 import SB3VecEnv
from elbow_gym.vector_env import ElbowArmVectorEnv

STEPS, ARMS = 12, 4
REMAINDERS = pytest.mark.filterwarnings("ignore:You have specified a mini-batch size")


@pytest.fixture(scope="module")
def env():
    return SB3VecEnv(ElbowArmVectorEnv(ARMS, duration=0.1, autoreset_mode="SameStep"))


def small(kind, env, activation=torch.nn.SiLU, **arguments):
    optimizer = {"optimizer_class": FlatAdam} if kind is PPO else {"optimizer_kwargs": {"eps": 1e-8}}
    shape = arguments.pop("net_arch", {"pi": [5, 6], "vf": [7]})
    layers = {"net_arch": shape, "activation_fn": activation, "log_std_init": -1.0}
    arguments = {"n_steps": STEPS, "batch_size": STEPS * ARMS, "n_epochs": 3, "learning_rate": 0.01, **arguments}
    model = kind("MlpPolicy", env, policy_kwargs={**layers, **optimizer}, seed=0, device="cpu", **arguments)
    model._setup_learn(1000)
    return model


def vector(model):
    return torch.nn.utils.parameters_to_vector(model.policy.parameters()).detach().clone()


def fill(buffer):
    rng = np.random.default_rng(0)
    for name in ("observations", "actions", "advantages", "returns"):
        array = getattr(buffer, name)
        array[:] = 0.3 * rng.normal(size=array.shape)
    buffer.full = True
    return rng


def same_order(patch, count):
    """Both learners take the same samples of every pass, theirs by arms first, ours by control periods first."""
    orders = [np.random.default_rng(k).permutation(STEPS * ARMS) for k in range(count)]
    ours, theirs = iter(orders), iter(orders)
    patch.setattr(torch, "randperm", lambda _: torch.from_numpy(next(ours)))
    patch.setattr(np.random, "permutation", lambda _: (order := next(theirs)) % ARMS * STEPS + order // ARMS)


@REMAINDERS
@pytest.mark.parametrize(
    ("activation", "arguments"),
    [
        (torch.nn.SiLU, {"max_grad_norm": 0.05}),
        (torch.nn.Tanh, {"target_kl": 0.1, "normalize_advantage": False}),
        (torch.nn.ReLU, {"batch_size": 33}),
        (torch.nn.ELU, {"batch_size": 33, "vf_coef": 0.2}),
        (torch.nn.ReLU, {"net_arch": {"pi": [], "vf": [7]}}),
        (torch.nn.SiLU, {"net_arch": {"pi": [1], "vf": []}}),
        # Left to the parent.
        (torch.nn.SiLU, {"use_sde": True}),
        (torch.nn.GELU, {}),
        (torch.nn.SiLU, {"clip_range_vf": 0.1}),
    ],
)
def test_update_is_that_of_stable_baselines3(env, monkeypatch, activation, arguments):
    own, theirs = (small(kind, env, activation, ent_coef=0.01, **arguments) for kind in (PPO, stable_baselines3.PPO))
    torch.testing.assert_close(vector(own), vector(theirs), rtol=0.0, atol=0.0)
    before = vector(own)
    if own._covered:
        same_order(monkeypatch, 3)
    for model in (own, theirs):
        buffer = model.rollout_buffer
        rng = fill(buffer)
        with torch.no_grad():
            flat = (torch.from_numpy(part).flatten(0, 1) for part in (buffer.observations, buffer.actions))
            log_probs = model.policy.evaluate_actions(*flat)[1].view(STEPS, ARMS)
        # Some beyond the clip, of either sign.
        buffer.log_probs[:] = log_probs.numpy() + 0.2 * rng.normal(size=(STEPS, ARMS))
        torch.manual_seed(0)
        np.random.seed(0)  # noqa: NPY002
        if model.use_sde:
            model.policy.reset_noise(ARMS)
        model.train()
    assert (vector(own) - before).abs().max() > 0.02
    assert own._n_updates == theirs._n_updates
    torch.testing.assert_close(vector(own), vector(theirs), rtol=1e-4, atol=1e-5)


@REMAINDERS
def test_update_ends_where_stable_baselines3_ends_it(env, monkeypatch):
    """The policy moves by more than the divergence that is allowed in one of the passes after the first."""
    limits = {"target_kl": 0.01, "batch_size": 20, "n_epochs": 5}
    own, theirs = (small(kind, env, **limits) for kind in (PPO, stable_baselines3.PPO))
    same_order(monkeypatch, 5)
    for model in (own, theirs):
        buffer = model.rollout_buffer
        fill(buffer)
        with torch.no_grad():
            flat = (torch.from_numpy(part).flatten(0, 1) for part in (buffer.observations, buffer.actions))
            buffer.log_probs[:] = model.policy.evaluate_actions(*flat)[1].view(STEPS, ARMS).numpy()
        model.train()
    assert 1 < own._n_updates == theirs._n_updates < 5
    torch.testing.assert_close(vector(own), vector(theirs), rtol=1e-4, atol=1e-5)
    ours, expected = (model.logger.name_to_value["train/approx_kl"] for model in (own, theirs))
    assert ours == pytest.approx(expected, rel=1e-3)


def test_layers_that_do_not_learn_stay(env):
    model = small(PPO, env)
    fill(model.rollout_buffer)
    before = vector(model)
    frozen = model.policy.mlp_extractor.policy_net[0].weight.requires_grad_(False)
    kept = frozen.clone()
    model.train()
    assert torch.equal(frozen, kept)
    assert not torch.equal(vector(model), before)


def test_a_number_that_is_none_reaches_the_actor(env):
    model = small(PPO, env)
    fill(model.rollout_buffer)
    model.rollout_buffer.advantages[0, 0] = np.nan
    model.train()
    assert model.policy.action_net.bias.isnan().all()


def test_deviations_that_are_not_learned_stay(env):
    model = small(PPO, env)
    fill(model.rollout_buffer)
    before, log_std = vector(model), model.policy.log_std.requires_grad_(False)
    model.train()
    assert torch.equal(log_std, torch.full_like(log_std, -1.0))
    assert not torch.equal(vector(model), before)


def test_rollout_holds_what_stable_baselines3_would_have_stored(env):
    model = small(PPO, env, gamma=0.9)
    env.seed(0)
    model._last_obs = first = env.reset()
    seen = []
    step = env.step

    def look(actions):
        seen.append((actions.copy(), *(part.copy() for part in step(actions))))
        for i in np.flatnonzero(seen[-1][3]):
            # Every other arm ends by itself.
            seen[-1][4][i]["TimeLimit.truncated"] = i % 2 == 0
        return tuple(part.copy() for part in seen[-1][1:])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(env, "step", look)
        from stable_baselines3.common.callbacks import ConvertCallback

        callback = ConvertCallback(lambda *_: True)
        callback.init_callback(model)
        assert model.collect_rollouts(env, callback, model.rollout_buffer, STEPS)
    buffer = model.rollout_buffer
    np.testing.assert_array_equal(buffer.observations[0], first)
    for k, (actions, after, reward, dones, infos) in enumerate(seen):
        np.testing.assert_array_equal(np.clip(buffer.actions[k], -1.0, 1.0), actions)
        if k + 1 < STEPS:
            np.testing.assert_array_equal(buffer.observations[k + 1], after)
            np.testing.assert_array_equal(buffer.episode_starts[k + 1], dones)
        for i in range(ARMS):
            more = 0.0
            if dones[i] and i % 2 == 0:
                last = torch.from_numpy(infos[i]["terminal_observation"][None])
                more = 0.9 * model.policy.predict_values(last).item()
            assert buffer.rewards[k, i] == pytest.approx(reward[i] + more, rel=1e-6)
    assert sum(dones.sum() for _, _, _, dones, _ in seen) == 2 * ARMS
    with torch.no_grad():
        flat = (torch.from_numpy(part).flatten(0, 1) for part in (buffer.observations, buffer.actions))
        values, log_probs, _ = model.policy.evaluate_actions(*flat)
    np.testing.assert_allclose(buffer.values.ravel(), values.ravel(), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(buffer.log_probs.ravel(), log_probs, rtol=1e-5, atol=1e-5)


def test_training_compiles_nothing_after_its_loops(env):
    """Whatever is called has the same types: there is one compiled form of each."""
    compile_loops()
    small(PPO, env).learn(STEPS * ARMS)
    assert (len(gradient_of.signatures), len(outputs_of.signatures)) == (1, 1)


def test_a_callback_ends_the_rollout(env):
    from stable_baselines3.common.callbacks import ConvertCallback

    model = small(PPO, env)
    env.seed(0)
    model._last_obs = env.reset()
    callback = ConvertCallback(lambda local, _: local["k"] < 3)
    callback.init_callback(model)
    assert not model.collect_rollouts(env, callback, model.rollout_buffer, STEPS)
    assert model.num_timesteps == 4 * ARMS

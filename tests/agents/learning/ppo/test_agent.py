"""The PPO: the updates and rollouts of Stable-Baselines3's, up to rounding."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

import stable_baselines3
import torch

from agents.learning.flat_adam import FlatAdam
from agents.learning.ppo.agent import PPO
from elbow_gym.sb3 import SB3VecEnv
from elbow_gym.vector_env import ElbowArmVectorEnv

STEPS, ARMS = 12, 4


@pytest.fixture(scope="module")
def env():
    return SB3VecEnv(ElbowArmVectorEnv(ARMS, duration=0.1, autoreset_mode="SameStep"))


def small(kind, env, activation=torch.nn.SiLU, **arguments):
    optimizer = {"optimizer_class": FlatAdam} if kind is PPO else {"optimizer_kwargs": {"eps": 1e-8}}
    layers = {"net_arch": {"pi": [5, 6], "vf": [7]}, "activation_fn": activation, "log_std_init": -1.0}
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


@pytest.mark.parametrize(
    ("activation", "arguments"),
    [
        (torch.nn.SiLU, {"max_grad_norm": 0.05}),
        (torch.nn.Tanh, {"target_kl": 0.1, "normalize_advantage": False}),
        (torch.nn.ReLU, {}),
        (torch.nn.ELU, {}),
        (torch.nn.SiLU, {"use_sde": True}),
    ],
)
def test_update_is_that_of_stable_baselines3(env, activation, arguments):
    own, theirs = (small(kind, env, activation, ent_coef=0.01, **arguments) for kind in (PPO, stable_baselines3.PPO))
    torch.testing.assert_close(vector(own), vector(theirs), rtol=0.0, atol=0.0)
    before = vector(own)
    for model in (own, theirs):
        buffer = model.rollout_buffer
        rng = fill(buffer)
        with torch.no_grad():
            flat = (torch.from_numpy(part).flatten(0, 1) for part in (buffer.observations, buffer.actions))
            log_probs = model.policy.evaluate_actions(*flat)[1].view(STEPS, ARMS)
        # Some beyond the clip, of either sign.
        buffer.log_probs[:] = log_probs.numpy() + 0.2 * rng.normal(size=(STEPS, ARMS))
        if model.use_sde:
            torch.manual_seed(0)
            model.policy.reset_noise(ARMS)
        model.train()
    assert (vector(own) - before).abs().max() > 0.02
    torch.testing.assert_close(vector(own), vector(theirs), rtol=1e-4, atol=1e-5)


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
            if dones[i]:
                last = torch.from_numpy(infos[i]["terminal_observation"][None])
                more = 0.9 * model.policy.predict_values(last).item()
            assert buffer.rewards[k, i] == pytest.approx(reward[i] + more, rel=1e-6)
    assert sum(dones.sum() for _, _, _, dones, _ in seen) == 2 * ARMS
    with torch.no_grad():
        flat = (torch.from_numpy(part).flatten(0, 1) for part in (buffer.observations, buffer.actions))
        values, log_probs, _ = model.policy.evaluate_actions(*flat)
    np.testing.assert_allclose(buffer.values.ravel(), values.ravel(), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(buffer.log_probs.ravel(), log_probs, rtol=1e-5, atol=1e-5)

"""The SAC: critics that are quadratic around the actor's slow copy, deaf to large errors."""

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.classic_control import PendulumEnv
from gymnasium.spaces import Box
from gymnasium.wrappers import TimeLimit

pytest.importorskip("stable_baselines3")

import torch

from agents.learning.sac.agent import SAC, Batch, CentredPolicy
from agents.learning.sac.critic import QuadraticCritics
from agents.learning.sac.inputs import Sharpened


def small(env=None, **arguments):
    return SAC(
        "MlpPolicy",
        TimeLimit(PendulumEnv(), 200) if env is None else env,
        policy_kwargs={"net_arch": [8], "view": Sharpened(3, [slice(0, 2)])},
        seed=0,
        device="cpu",
        **{"learning_starts": 20, **arguments},
    )


def weights(module):
    return torch.nn.utils.parameters_to_vector(module.parameters()).detach().clone()


def critics():
    torch.manual_seed(0)
    return QuadraticCritics(Sharpened(4, [slice(1, 4)]), 3, (6, 7), rank=2), torch.randn(5, 4)


@pytest.mark.slow
def test_critics_are_two_plain_networks_side_by_side():
    both, observation = critics()
    for k in range(2):
        x = both.view(observation)
        for j, (weight, bias) in enumerate(zip(both.weights, both.biases, strict=True)):
            x = torch.nn.functional.linear(torch.relu(x) if j else x, weight[k].T, bias[k, 0])
        value, slope, curvature, factors = both(observation)
        expected = x.split((1, 3, 3, 6), -1)
        torch.testing.assert_close(value[k], expected[0][:, 0])
        torch.testing.assert_close(slope[k], expected[1])
        torch.testing.assert_close(curvature[k], torch.log1p(torch.exp(expected[2])))
        torch.testing.assert_close(factors[k], expected[3].reshape(5, 2, 3))


def test_quadratic_is_the_form_that_its_parts_say():
    both, observation = critics()
    quadratic = both(observation)
    departure = torch.randn(5, 3, requires_grad=True)
    form = torch.diag_embed(quadratic.curvature) + quadratic.factors.mT @ quadratic.factors
    expected = quadratic.value + (quadratic.slope * departure).sum(-1)
    expected = expected - 0.5 * torch.einsum("bi,kbij,bj->kb", departure, form, departure)
    torch.testing.assert_close(quadratic(departure), expected)
    torch.testing.assert_close(quadratic(torch.zeros(5, 3)), quadratic.value)
    (slope,) = torch.autograd.grad(quadratic(departure)[1].sum(), departure)
    expected = quadratic.slope[1] - torch.einsum("bij,bj->bi", form[1], departure)
    torch.testing.assert_close(slope, expected)
    assert torch.linalg.eigvalsh(form).min() > 0.0
    assert not quadratic.detach()(departure.detach()).requires_grad


@pytest.mark.slow
def test_linear_loss_pulls_no_harder_however_large_the_error():
    value = torch.tensor([[0.0], [0.1], [2.0], [2000.0]], requires_grad=True)
    loss = small(huber_delta=0.2)._loss(value, torch.zeros(4, 1))
    assert loss.item() == pytest.approx((0.1**2 / 2 + 0.2 * (2.0 - 0.1) + 0.2 * (2000.0 - 0.1)) / 4)
    loss.backward()
    assert (4 * value.grad.ravel()).tolist() == pytest.approx([0.0, 0.1, 0.2, 0.2])
    squared = small()._loss(torch.tensor([1.0, 3.0]), torch.zeros(2))
    assert squared.item() == pytest.approx((1.0 + 9.0) / 4)


def make_constant(critics, value, slope):
    """Lets two critics of one joint say the same everywhere: their values at the centre and their slopes."""
    with torch.no_grad():
        critics.weights[-1].zero_()
        critics.biases[-1].zero_()
        critics.biases[-1][:, 0, 0] = torch.tensor(value)
        critics.biases[-1][:, 0, 1] = torch.tensor(slope)
        # Next to no curvature.
        critics.biases[-1][:, 0, 2] = -40.0


def make_steady(actor, log_std):
    """Lets an actor act with mean 0 and one standard deviation everywhere."""
    with torch.no_grad():
        for layer in (actor.mu, actor.log_std):
            layer.weight.zero_()
            layer.bias.zero_()
        actor.log_std.bias.fill_(log_std)


def test_target_is_the_reward_and_the_worse_critics_discounted_value_with_the_entropy():
    model, count = small(ent_coef=0.5), 4000
    make_constant(model.critic_target, (3.0, 5.0), (0.0, 0.0))
    make_steady(model.actor, -3.0)
    model.policy.follow(1.0, 1.0)
    reward, discount = torch.linspace(-1.0, 1.0, count), torch.full((count,), 0.9)
    discount[0] = 0.0
    batch = Batch(torch.zeros(count, 3), torch.zeros(count, 1), reward, discount, torch.zeros(count, 3))
    torch.testing.assert_close(model._target(batch, torch.tensor(0.0)), reward + discount * 3.0)
    paid = model._target(batch, torch.tensor(0.5)) - (reward + discount * 3.0)
    assert paid[0] == 0.0
    # A normal distribution's entropy, which the tanh hardly changes at so small a deviation.
    entropy = 0.5 * np.log(2.0 * np.pi * np.e) - 3.0
    assert paid[1:].mean().item() == pytest.approx(0.5 * 0.9 * entropy, abs=0.02)


def batch_of(count):
    observation, after = torch.randn(2, count, 3)
    return Batch(observation, torch.zeros(count, 1), torch.zeros(count), torch.ones(count), after)


@pytest.mark.parametrize("slope", [(1.0, -1.0), (-1.0, 1.0)])
def test_actor_climbs_the_slope_of_the_worse_critic(slope):
    model = small(ent_coef=0.0, actor_rate=1.0)
    make_constant(model.critic, (0.0, 10.0), slope)
    batch = batch_of(64)
    before = model.actor(batch.observation, deterministic=True)
    model._step(batch)
    assert ((model.actor(batch.observation, deterministic=True) - before) * slope[0] > 0.0).all()


@pytest.mark.parametrize(("ent_coef", "wider"), [(1.0, True), (0.0, False)])
def test_actor_is_paid_for_its_entropy(ent_coef, wider):
    model = small(ent_coef=ent_coef, actor_rate=1.0)
    make_constant(model.critic, (0.0, 0.0), (0.0, 0.0))
    make_steady(model.actor, -2.0)
    batch = batch_of(64)
    model._step(batch)
    log_std = model.actor.get_action_dist_params(batch.observation)[1]
    assert (log_std > -2.0).all() == wider


def test_actor_waits_for_the_critics_and_the_centre_trails_it():
    model = small(critic_head_start=30, center_tau=0.25, average_tau=0.125, actor_rate=0.1)
    with torch.no_grad():
        # Whatever the actor was given after it was built: the centre starts there.
        model.actor.mu.bias.add_(0.1)
    actor, critic = weights(model.actor), weights(model.critic)
    model.learn(50)
    assert (model._n_updates, model.num_timesteps) == (30, 50)
    assert not torch.equal(weights(model.critic), critic)
    assert torch.equal(weights(model.actor), actor)
    mean = torch.nn.Sequential(*model.actor.latent_pi, model.actor.mu)
    start = weights(mean)
    assert torch.equal(weights(model.policy.center), start)
    assert torch.equal(weights(model.policy.average), start)
    model.train(1, 16)
    first = weights(mean)
    assert not torch.equal(first, start)
    assert torch.equal(weights(model.policy.center), start)
    rates = [optimizer.param_groups[0]["lr"] for optimizer in (model.actor.optimizer, model.critic.optimizer)]
    assert rates == pytest.approx([0.1 * 3e-4, 3e-4])
    model.train(1, 16)
    torch.testing.assert_close(weights(model.policy.center), start + 0.25 * (first - start))
    torch.testing.assert_close(weights(model.policy.average), start + 0.125 * (first - start))
    model.train(1, 16)
    assert model._n_updates == 33


def test_deterministic_predictions_are_the_average_and_others_the_actor():
    model = small()
    with torch.no_grad():
        model.actor.mu.bias.fill_(0.5)
        model.actor.log_std.weight.zero_()
        model.actor.log_std.bias.fill_(-20.0)
    observation = np.zeros((4, 3), np.float32)
    before = model.predict(observation, deterministic=True)[0]
    assert np.abs(model.predict(observation)[0] - before).min() > 0.1
    model.policy.follow(0.0, 1.0)
    np.testing.assert_allclose(model.predict(observation, deterministic=True)[0], model.predict(observation)[0], 1e-6)


@pytest.mark.slow
def test_proximity_holds_the_actor_to_the_centre():
    def departure(proximity):
        model = small(proximity=proximity, learning_rate=3e-3, center_tau=0.0)
        model.learn(100)
        mean = torch.nn.Sequential(*model.actor.latent_pi, model.actor.mu, torch.nn.Tanh())
        observation = torch.from_numpy(model.replay_buffer.observations[:100, 0])
        return (mean(observation) - model.policy.center(observation)).abs().mean().item()

    assert departure(1e4) < 0.2 * departure(0.0)


@pytest.mark.parametrize(("log_prob", "direction"), [(3.0, 1), (0.0, -1), (1.0, 0)])
def test_price_of_entropy_rises_while_there_is_less_than_its_target_and_falls_while_there_is_more(log_prob, direction):
    # The target, -1, is met at a mean log-probability of 1; a larger one means less entropy.
    model = small(ent_coef="auto_0.1", target_entropy=-1.0)
    before = model.log_ent_coef.item()
    model._price_entropy(torch.tensor([log_prob]))
    assert np.sign(model.log_ent_coef.item() - before) == direction


class Bandit(gymnasium.Env):
    """One period an episode, whose best action follows from the observation."""

    observation_space = Box(-1.0, 1.0, (2,))
    action_space = Box(-1.0, 1.0, (2,))
    form = np.array([[2.0, 0.8], [0.8, 1.0]])

    def best(self, observation):
        return 0.5 * observation[..., ::-1] * [1.0, -1.0]

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.seen = self.np_random.uniform(-1.0, 1.0, 2).astype(np.float32)
        return self.seen, {}

    def step(self, action):
        miss = action - self.best(self.seen)
        return self.seen, -0.5 * float(miss @ self.form @ miss), True, False, {}


@pytest.mark.soak
def test_learns_the_best_action_of_a_quadratic_problem():
    model = SAC(
        "MlpPolicy",
        Bandit(),
        learning_rate=3e-3,
        learning_starts=500,
        policy_kwargs={"net_arch": [32]},
        ent_coef=0.002,
        actor_rate=0.5,
        center_tau=0.02,
        average_tau=0.02,
        seed=0,
        device="cpu",
    )
    model.learn(1500)
    observation = np.random.default_rng(0).uniform(-0.8, 0.8, (50, 2)).astype(np.float32)
    action, _ = model.predict(observation, deterministic=True)
    untrained = np.abs(Bandit().best(observation)).mean()
    assert np.abs(action - Bandit().best(observation)).mean() < 0.2 * untrained
    quadratic = model.critic(torch.from_numpy(observation))
    form = torch.diag_embed(quadratic.curvature) + quadratic.factors.mT @ quadratic.factors
    np.testing.assert_allclose(form.mean((0, 1)).detach().numpy(), Bandit.form, atol=0.3)


def test_saved_model_comes_back_with_its_centre(tmp_path):
    model = small(huber_delta=0.2, actor_rate=0.3, center_tau=0.01, average_tau=0.03, critic_head_start=5)
    model.learn(40)
    model.save(tmp_path / "model")
    again = SAC.load(tmp_path / "model")
    names = ("huber_delta", "actor_rate", "center_tau", "average_tau", "critic_head_start", "_n_updates")
    assert [getattr(again, name) for name in names] == [0.2, 0.3, 0.01, 0.03, 5, 20]
    for (name, expected), loaded in zip(
        model.policy.state_dict().items(), again.policy.state_dict().values(), strict=True
    ):
        assert torch.equal(loaded, expected), name
    model.policy.save(tmp_path / "policy")
    alone = CentredPolicy.load(tmp_path / "policy")
    assert alone.critic.view.vectors == (slice(0, 2),)
    assert any(name.startswith("center") for name in again.policy.state_dict())


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [{}, {"use_sde": True}, {"n_steps": 3}, {"gradient_steps": -1, "train_freq": 4}])
def test_same_seed_gives_the_same_weights(arguments):
    first, second = (small(**arguments).learn(60).policy.state_dict() for _ in range(2))
    assert all(torch.equal(first[name], second[name]) for name in first)
    start = small(**arguments).learn(20).policy.state_dict()
    assert not torch.equal(first["center.0.weight"], start["center.0.weight"])

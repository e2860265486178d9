"""PPO's compiled gradient: what torch records, up to rounding."""

from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("torch")

import torch
from torch import nn

from agents.learning.flat_adam import FlatAdam
from agents.learning.layers import KINDS, kind_of, places_of
from agents.learning.passes import ROWS, room_for
from agents.learning.ppo.gradient import Loss, Networks, Samples, gradient_of

SIZE, JOINTS, SAMPLES = 7, 3, 2 * ROWS + 40


def network(activation, *widths):
    layers = [part for pair in pairwise(widths) for part in (nn.Linear(*pair), activation())]
    return nn.Sequential(*layers[:-1])


@pytest.fixture(params=list(KINDS), ids=lambda kind: kind.__name__)
def learner(request):
    """Actor, critic, logarithms of the deviations, and where they lie in one tensor."""
    torch.manual_seed(0)
    actor, critic = network(request.param, SIZE, 20, 5, JOINTS), network(request.param, SIZE, 33, 1)
    log_std = nn.Parameter(torch.tensor([-1.0, -0.5, 0.1]))
    optimizer = FlatAdam([log_std, *actor.parameters(), *critic.parameters()], lr=0.1)
    where = Networks(
        places_of(actor, optimizer.place),
        places_of(critic, optimizer.place),
        kind_of(actor),
        optimizer.place(log_std),
    )
    return actor, critic, log_std, optimizer, where


@pytest.mark.parametrize("normalize", [True, False])
def test_gradient_is_what_torch_records(learner, normalize):
    actor, critic, log_std, optimizer, where = learner
    rng = np.random.default_rng(1)
    shapes = {"observation": (SIZE,), "action": (JOINTS,), "log_prob": (), "advantage": (), "returns": ()}
    arrays = {name: rng.normal(size=(2 * SAMPLES, *shape)).astype(np.float32) for name, shape in shapes.items()}
    whole = {name: torch.from_numpy(array) for name, array in arrays.items()}
    with torch.no_grad():
        old = torch.distributions.Normal(actor(whole["observation"]), log_std.exp())
        # Ratios on both sides of the clip.
        arrays["log_prob"][:] = old.log_prob(whole["action"]).sum(-1) + 0.3 * whole["log_prob"]
    batch = rng.permutation(2 * SAMPLES)[:SAMPLES]
    chosen = {name: part[batch] for name, part in whole.items()}
    new = torch.distributions.Normal(actor(chosen["observation"]), log_std.exp())
    log_ratio = new.log_prob(chosen["action"]).sum(-1) - chosen["log_prob"]
    ratio, advantage = log_ratio.exp(), chosen["advantage"]
    if normalize:
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    policy = -torch.minimum(advantage * ratio, advantage * ratio.clamp(0.8, 1.2)).mean()
    value = (critic(chosen["observation"]).squeeze(-1) - chosen["returns"]).square().mean()
    optimizer.zero_grad()
    (policy + 0.25 * value).backward()
    expected, own = optimizer.gradient.numpy().copy(), np.full(len(optimizer.gradient), np.nan, np.float32)
    figures, room = np.full(4, np.nan), room_for(where.actor, where.critic)
    samples, loss = Samples(**arrays), Loss(0.2, 0.25, normalize)
    gradient_of(batch, samples, optimizer.values.numpy(), where, loss, room, own, figures)
    np.testing.assert_allclose(own, expected, rtol=1e-4, atol=2e-6)
    beyond, divergence = (ratio - 1.0).abs() > 0.2, ratio - 1.0 - log_ratio
    assert 0.1 < beyond.float().mean() < 0.9
    means = [policy.item(), beyond.float().mean().item(), divergence.mean().item(), value.item()]
    np.testing.assert_allclose(figures, means, rtol=1e-4, atol=1e-6)


def test_advantage_of_a_batch_of_one_is_left_as_it_is(learner):
    actor, _, log_std, optimizer, where = learner
    x = torch.ones(1, SIZE)
    with torch.no_grad():
        mean = actor(x)
        log_prob = torch.distributions.Normal(mean, log_std.exp()).log_prob(mean).sum(-1)
    samples = Samples(x.numpy(), mean.numpy(), log_prob.numpy(), np.float32([3.0]), np.float32([0.0]))
    figures, gradient, loss = np.zeros(4), np.zeros(len(optimizer.values), np.float32), Loss(0.2, 0.5, normalize=True)
    room = room_for(where.actor, where.critic)
    gradient_of(np.zeros(1, np.int64), samples, optimizer.values.numpy(), where, loss, room, gradient, figures)
    assert figures[0] == pytest.approx(-3.0, rel=1e-5)
    assert np.isfinite(gradient).all()

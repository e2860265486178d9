"""The SAC with Huber's loss: Stable-Baselines3's own without it, deaf to large errors with it."""

import numpy as np
import pytest
import stable_baselines3
import torch
from gymnasium.envs.classic_control import PendulumEnv
from gymnasium.wrappers import TimeLimit

from agents.sac import SAC


def trained(model_class, **arguments):
    model = model_class(
        "MlpPolicy",
        TimeLimit(PendulumEnv(), 200),
        learning_starts=20,
        policy_kwargs={"net_arch": [8]},
        seed=0,
        device="cpu",
        **arguments,
    )
    return model.learn(60)


@pytest.mark.parametrize("arguments", [{}, {"ent_coef": 0.1}, {"use_sde": True}, {"n_steps": 3}])
def test_squared_loss_is_stable_baselines3s_own(arguments):
    expected = trained(stable_baselines3.SAC, **arguments).policy.state_dict()
    for name, weights in trained(SAC, **arguments).policy.state_dict().items():
        np.testing.assert_allclose(weights, expected[name], rtol=1e-4, atol=1e-6, err_msg=name)


def test_linear_loss_pulls_no_harder_however_large_the_error(tmp_path):
    model = trained(SAC, huber_delta=0.2)
    value = torch.tensor([[0.0], [0.1], [2.0], [2000.0]], requires_grad=True)
    loss = model._loss(value, torch.zeros(4, 1))
    assert loss.item() == pytest.approx((0.1**2 / 2 + 0.2 * (2.0 - 0.1) + 0.2 * (2000.0 - 0.1)) / 4)
    loss.backward()
    assert (4 * value.grad.ravel()).tolist() == pytest.approx([0.0, 0.1, 0.2, 0.2])
    model.save(tmp_path / "model")
    assert SAC.load(tmp_path / "model").huber_delta == 0.2

"""The recipe of Tianshou: its adapter beside the batch, and that it learns."""

import gymnasium as gym
import numpy as np
import pytest

from tests.support.recipes import returns_of

pytest.importorskip("tianshou")

from agents.recipes import tianshou_ppo


def batch():
    return gym.make_vec("elbow_gym:ElbowArm-v0", 3, autoreset_mode="Disabled", duration=0.1)


def test_adapter_steps_as_the_batch_and_resets_the_arms_asked_for():
    ours, twin = tianshou_ppo.Batch(batch()), batch()
    still = np.zeros((3, 10), dtype=np.float32)
    np.testing.assert_array_equal(ours.reset(seed=0)[0], twin.reset(seed=0)[0])
    for _ in range(5):
        found, expected = ours.step(still), twin.step(still)
        for one, other in zip(found[:4], expected[:4], strict=True):
            np.testing.assert_array_equal(one, other)
    assert found[3].all()
    observation, infos = ours.reset([0, 2])
    mask = np.array([True, False, True])
    np.testing.assert_array_equal(observation, twin.reset(options={"reset_mask": mask})[0][mask])
    assert len(infos) == 2


def test_adapter_gives_the_space_of_one_arm_once_per_arm():
    ours = tianshou_ppo.Batch(batch())
    assert [space.shape for space in ours.action_space] == [(10,)] * 3
    assert len(ours) == 3


def test_adapter_refuses_a_step_of_some_arms():
    ours = tianshou_ppo.Batch(batch())
    ours.reset()
    with pytest.raises(ValueError, match=r"id must be all 3 arms, got \[1\]"):
        ours.step(np.zeros((1, 10)), id=[1])


@pytest.mark.slow
def test_return_rises_within_three_updates():
    returns = returns_of(tianshou_ppo.train, 48_000)
    assert len(returns) == 3
    assert returns[-1] > returns[0] + 20.0

"""The recipe of TorchRL: autoreset modes that it takes, the last observation of an episode, and that it learns."""

import warnings

import gymnasium as gym
import numpy as np
import pytest

from tests.support.recipes import returns_of

pytest.importorskip("torchrl")

import torch

with warnings.catch_warnings():
    # Warnings that the library gives when it is imported.
    warnings.simplefilter("ignore")
    from tensordict import TensorDictBase
    from torchrl.envs import GymWrapper

    from agents.recipes import torchrl_ppo

# Warnings of the library are not this project's.
pytestmark = pytest.mark.filterwarnings("ignore")


def batch(**arguments):
    return gym.make_vec("elbow_gym:ElbowArm-v0", 2, duration=0.1, **arguments)


def test_next_step_is_refused_by_the_library():
    with pytest.raises(RuntimeError, match="SAME_STEP"):
        GymWrapper(batch())


def test_last_observation_of_an_episode_is_the_batchs_final_one():
    env, twin = GymWrapper(batch(autoreset_mode="SameStep")), batch(autoreset_mode="SameStep")
    seed = 3
    twin.reset(seed=seed)
    start = env.reset(seed=seed)
    still = torch.zeros(2, 10)

    def idle(data: TensorDictBase) -> TensorDictBase:
        return data.set("action", still)

    played = env.rollout(6, policy=idle, break_when_any_done=False, auto_reset=False, tensordict=start)
    outcomes = [twin.step(still.numpy()) for _ in range(6)]
    np.testing.assert_array_equal(played["next", "truncated"][:, 4, 0], [True, True])
    np.testing.assert_array_equal(played["next", "observation"][:, 4], np.stack(outcomes[4][4]["final_obs"]))
    # TorchRL resets arms that all end together once more, so that the starts are others than the twin's.
    moving = [np.abs(twin.decode(played["observation"][:, k].numpy())["joint_velocity"]).max() for k in (4, 5)]
    assert moving[0] > 0.0 == moving[1]


@pytest.mark.slow
def test_return_rises_within_three_updates():
    returns = returns_of(torchrl_ppo.train, 48_000)
    assert len(returns) == 3
    assert returns[-1] > returns[0] + 20.0

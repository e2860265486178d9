"""Training runs end to end on a small budget, keeps the best policy, and survives an interruption."""

import json

import numpy as np
import pytest
from stable_baselines3 import PPO

from agents.keeper import Keeper
from agents.policy import load_policy
from agents.train import PPOSettings, train_ppo
from elbow_gym.settings import Settings

SMALL = PPOSettings(total_timesteps=512, num_envs=4, n_steps=64, batch_size=64, n_epochs=1, hidden=(8,))


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    return folder, train_ppo(Settings(duration=1.0, start="on_target"), SMALL, 0, folder, checkpoint_every=256)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::PendingDeprecationWarning")
class TestRun:
    def test_writes_policy_checkpoint_and_tensorboard(self, run):
        folder, policy = run
        back = load_policy(folder / "best")
        assert back.card == policy.card
        assert PPO.load(folder / "checkpoint.zip", device="cpu").num_timesteps >= 256
        assert list((folder / "tensorboard").rglob("events*"))

    def test_card_tells_how_it_was_made(self, run):
        card = json.loads((run[0] / "best.json").read_text())
        assert card["training"]["seed"] == 0
        assert card["training"]["num_envs"] == 4
        assert card["environment"]["duration"] == 1.0
        assert np.isfinite(card["evaluation"]["return"])


def test_interrupt_keeps_the_best_policy(tmp_path, monkeypatch, capsys):
    def interrupt(self):
        if self.num_timesteps > 256:
            raise KeyboardInterrupt
        return True

    monkeypatch.setattr(Keeper, "_on_step", interrupt)
    train_ppo(Settings(duration=1.0, start="on_target"), SMALL, 0, tmp_path, checkpoint_every=256)
    assert "interrupted; keeping the best policy so far" in capsys.readouterr().err
    assert load_policy(tmp_path / "best").card.training["timesteps"] < 512


def test_same_seed_trains_the_same_policy(tmp_path):
    settings = Settings(duration=1.0)
    twice = [train_ppo(settings, SMALL, 3, tmp_path / str(k), checkpoint_every=512) for k in range(2)]
    for name, weights in twice[0].weights.items():
        np.testing.assert_array_equal(weights, twice[1].weights[name])

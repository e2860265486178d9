"""The recipe of Stable-Baselines3: it learns, logs joules and films."""

import numpy as np
import pytest

from tests.support.recipes import returns_of

pytest.importorskip("stable_baselines3")

from agents.recipes import sb3_ppo


@pytest.mark.soak
def test_return_rises_within_six_updates():
    returns = returns_of(sb3_ppo.train, 96_000)
    assert len(returns) == 6
    assert returns[-1] > returns[0] + 20.0


@pytest.mark.slow
def test_joules_of_the_episodes_are_in_tensorboard(tmp_path, monkeypatch):
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    monkeypatch.setattr(sb3_ppo, "NUM_ENVS", 4)
    model = sb3_ppo.train(1000, log=tmp_path)
    events = accumulator.EventAccumulator(str(next(tmp_path.iterdir())))
    events.Reload()
    logged = events.Scalars("rollout/electrical_energy")[-1].value
    assert logged == pytest.approx(np.mean([episode["electrical_energy"] for episode in model.ep_info_buffer]))
    assert logged > 0.0


@pytest.mark.slow
def test_film_is_a_video(tmp_path):
    pytest.importorskip("moviepy")
    pytest.importorskip("pygame")
    model = sb3_ppo.PPO("MlpPolicy", sb3_ppo.environment(2), device="cpu")
    videos = sb3_ppo.film(model, tmp_path, periods=5, render_width=160, render_height=120)
    assert len(videos) == 1
    assert videos[0].stat().st_size > 1000

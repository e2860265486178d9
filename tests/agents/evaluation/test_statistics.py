"""Models trained behind a VecNormalize: played with the statistics beside them, refused without."""

import numpy as np
import pytest

from agents.evaluation.players import find_player
from agents.evaluation.statistics import Statistics, statistics_file
from agents.learning.export import export
from agents.task_options import TaskOptions
from elbow_gym import ElbowArmVectorEnv

OPTIONS = {"n_steps": 4, "batch_size": 8, "n_epochs": 1, "device": "cpu", "policy_kwargs": {"net_arch": [8]}}


def test_statistics_are_found_under_the_names_that_libraries_give(tmp_path):
    (tmp_path / "vecnormalize.pkl").touch()
    (tmp_path / "rl_model_vecnormalize_1000_steps.pkl").touch()
    assert statistics_file(tmp_path / "sac.zip") == tmp_path / "vecnormalize.pkl"
    assert statistics_file(tmp_path / "rl_model_1000_steps.zip") == tmp_path / "rl_model_vecnormalize_1000_steps.pkl"
    assert statistics_file(tmp_path / "rl_model_2000_steps.zip") is None
    (tmp_path / "sac_vecnormalize.pkl").touch()
    assert statistics_file(tmp_path / "sac.zip") == tmp_path / "sac_vecnormalize.pkl"


def test_a_file_that_holds_no_statistics_is_named(tmp_path):
    (tmp_path / "vecnormalize.pkl").write_bytes(b"none")
    with pytest.raises(ValueError, match=r"vecnormalize\.pkl must hold the statistics of a VecNormalize, got: "):
        Statistics.read(tmp_path / "vecnormalize.pkl", 41)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A PPO model that has learned behind a VecNormalize, its folder and its environment."""
    sb3 = pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.vec_env import VecNormalize

    from elbow_gym.sb3 import SB3VecEnv

    folder = tmp_path_factory.mktemp("normalised")
    arms = VecNormalize(SB3VecEnv(ElbowArmVectorEnv(2, autoreset_mode="SameStep")), clip_obs=5.0)
    model = sb3.PPO("MlpPolicy", arms, seed=1, **OPTIONS).learn(16)
    model.save(folder / "model")
    return model, folder, arms


def controller(folder):
    return find_player(str(folder / "model.zip"), 2, trust=True).make(ElbowArmVectorEnv(2))


@pytest.mark.slow
def test_without_its_statistics_such_a_model_is_refused(trained):
    _, folder, _ = trained
    wanted = r"must be trained on the environment's own observations or have the file of its VecNormalize beside it, "
    with pytest.raises(ValueError, match=rf"model\.zip {wanted}model_vecnormalize\.pkl or vecnormalize\.pkl, got none"):
        controller(folder)


@pytest.mark.slow
def test_with_its_statistics_it_acts_as_in_its_training(trained, monkeypatch):
    model, folder, arms = trained
    file = folder / "vecnormalize.pkl"
    before = find_player(str(folder / "model.zip"), 2, trust=True).identity
    arms.save(str(file))
    plain = arms.venv.reset()
    arms.training = False
    wanted = model.predict(arms.normalize_obs(plain), deterministic=True)[0]
    found = controller(folder).predict(plain, deterministic=True)[0]
    np.testing.assert_allclose(found, wanted, atol=1e-6)
    assert np.abs(found - model.predict(plain, deterministic=True)[0]).max() > 1e-3
    # What was played with other statistics is not taken over.
    assert find_player(str(folder / "model.zip"), 2, trust=True).identity != before
    monkeypatch.setattr(arms.obs_rms, "mean", arms.obs_rms.mean + 3.0)
    arms.save(str(file))
    with pytest.raises(ValueError, match=r"got vecnormalize\.pkl, which is of another training"):
        controller(folder)
    file.unlink()


@pytest.mark.slow
def test_an_exported_model_takes_the_environments_observations(trained):
    pytest.importorskip("onnxruntime")
    model, folder, arms = trained
    file = folder / "model_vecnormalize.pkl"
    arms.save(str(file))
    export(str(folder / "model.zip"), folder / "model.onnx", TaskOptions(elbows=2), trust=True)
    plain = arms.venv.reset()
    wanted = np.clip(model.policy.predict(arms.normalize_obs(plain), deterministic=True)[0], -1.0, 1.0)
    played = find_player(str(folder / "model.onnx"), 2).make(ElbowArmVectorEnv(2)).predict(plain)[0]
    file.unlink()
    # Entries at clip_obs apart, where the policy has no limit.
    inside = (np.abs(arms.normalize_obs(plain)) < 5.0).all(axis=1)
    np.testing.assert_allclose(played[inside], wanted[inside], atol=1e-4)
    assert inside.any()


@pytest.mark.slow
def test_statistics_of_rewards_alone_change_nothing(tmp_path):
    sb3 = pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.vec_env import VecNormalize

    from elbow_gym.sb3 import SB3VecEnv

    arms = VecNormalize(SB3VecEnv(ElbowArmVectorEnv(2, autoreset_mode="SameStep")), norm_obs=False)
    model = sb3.PPO("MlpPolicy", arms, seed=1, **OPTIONS).learn(8)
    model.save(tmp_path / "model")
    plain = arms.reset()
    np.testing.assert_array_equal(
        controller(tmp_path).predict(plain, deterministic=True)[0], model.predict(plain, deterministic=True)[0]
    )

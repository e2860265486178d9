"""Clones of the optimum: they learn from their teacher, repeat for the same seed, and leave whole runs."""

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from agents.control.lqr import TimeVaryingLQR
from agents.control.trajectory import Trajectory
from agents.learning import rounds
from agents.learning.clone import clone, clone_all
from agents.learning.clone_settings import CloneSettings
from agents.learning.evaluation import evaluation
from agents.learning.publish import publish
from agents.shipped import OPTIMA
from elbow_gym.baselines.policy import read_policy
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv
from tests.support.workers import in_this_process

PERIODS = 15
SETTINGS = Settings(elbows=2, duration=PERIODS * 0.02)
SMALL = CloneSettings(rounds=4, num_envs=4, gradient_steps=40, batch_size=64, hidden=(32,), learning_rate=1e-2)


@pytest.fixture(scope="module")
def beginning():
    whole = Trajectory.load(OPTIMA / "elbows2.npz")
    states = {name: getattr(whole, name)[: PERIODS + 1] for name in ("q", "q_dot", "current")}
    return replace(whole, **states, voltage=whole.voltage[:PERIODS])


def test_clone_acts_as_its_teacher_where_the_teacher_goes(beginning):
    seen = []
    policy = clone(SETTINGS, beginning, SMALL, 0, {"command": ""}, lambda steps, policy: seen.append((steps, policy)))
    assert [steps for steps, _ in seen] == [4 * PERIODS * k for k in (1, 2, 3, 4)]
    env = ElbowArmVectorEnv(3, **SETTINGS.arguments, autoreset_mode="Disabled")
    teacher, gaps, sizes = TimeVaryingLQR(env, beginning), [], []
    observation, _ = env.reset(seed=123)
    for _ in range(PERIODS):
        action = teacher.predict(observation)[0]
        gaps.append(policy.predict(observation)[0] - action)
        sizes.append(action)
        observation, *_ = env.step(action)
    assert np.sqrt(np.mean(np.square(gaps))) < 0.3 * np.sqrt(np.mean(np.square(sizes)))


def test_same_seed_gives_the_same_clone_bit_for_bit(beginning):
    twice = [clone(SETTINGS, beginning, SMALL, 3, {"command": ""}, lambda *_: None) for _ in range(2)]
    other = clone(SETTINGS, beginning, SMALL, 4, {"command": ""}, lambda *_: None)
    assert twice[0].card.digest == twice[1].card.digest != other.card.digest


@pytest.fixture
def here(monkeypatch):
    monkeypatch.setattr(rounds, "do_all", in_this_process)


@pytest.mark.usefixtures("here")
def test_run_of_a_clone_can_be_published_and_loaded(tmp_path, beginning):
    beginning.save(tmp_path / "beginning.npz")
    folder = tmp_path / "clone_elbows2_seed5"
    result = clone_all(SETTINGS, tmp_path / "beginning.npz", SMALL, [5], [folder], "command")[5]
    assert result["finished"]
    assert json.loads((folder / "result.json").read_text()) == result
    places = {name: tmp_path / name for name in ("baselines", "policies", "curves")}
    assert publish([folder], **places) == ["clone_elbows2_seed5"]
    policy = read_policy(tmp_path / "baselines" / "clone_elbows2_seed5")
    assert evaluation(policy, SETTINGS)["return"] == pytest.approx(result["best"]["return"])
    with pytest.raises(ValueError, match="output must be free of earlier runs"):
        clone_all(SETTINGS, tmp_path / "beginning.npz", SMALL, [5], [folder], "command")
    with pytest.raises(ValueError, match="trajectory must be a file"):
        clone_all(SETTINGS, tmp_path / "nothing.npz", SMALL, [6], [tmp_path / "other"], "command")


@pytest.mark.usefixtures("here")
def test_resumed_clones_leave_finished_seeds_alone(tmp_path, beginning):
    beginning.save(tmp_path / "beginning.npz")
    seeds, folders = [5, 6], [tmp_path / "five", tmp_path / "six"]

    def run(how, chosen, resume=True):
        return clone_all(SETTINGS, tmp_path / "beginning.npz", how, seeds[:chosen], folders[:chosen], "command", resume)

    first = run(SMALL, 1)
    written = (folders[0] / "best.safetensors").stat().st_mtime_ns
    folders[1].mkdir()
    with pytest.raises(ValueError, match=r"settings\.rounds of a resumed run must be 4 .* got 3"):
        run(replace(SMALL, rounds=3), 2)
    assert not list(folders[1].iterdir())
    both = run(SMALL, 2)
    assert list(both) == seeds
    assert both[5] == first[5]
    assert (folders[0] / "best.safetensors").stat().st_mtime_ns == written
    assert both[6]["best"] != both[5]["best"]
    (folders[0] / "run.json").unlink()
    with pytest.raises(ValueError, match=r"free of runs without run\.json"):
        run(SMALL, 1)

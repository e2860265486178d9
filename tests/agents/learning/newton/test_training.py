"""Training on Newton's steps: it learns, goes on from its checkpoint, and leaves whole runs."""

from dataclasses import replace

import pytest

pytest.importorskip("torch")

from agents.learning import rounds
from agents.learning.newton.runs import CHECKPOINT, newton_all
from agents.learning.newton.settings import NewtonSettings
from agents.learning.newton.training import Training
from agents.tasks import plain_arguments, task_settings
from elbow_gym import load_policy
from elbow_gym.baselines.policy import read_policy
from elbow_gym.task.settings import Settings
from tests.support.workers import in_this_process

ENV = "ElbowArmTasks-v0"
SETTINGS = Settings(**plain_arguments(task_settings(ENV, 2, {"duration": 0.2})))
SMALL = NewtonSettings(
    rounds=4, num_envs=3, led_rounds=1, newton_steps=1, gradient_steps=40, batch_size=64, hidden=(32,), evaluate_every=2
)


@pytest.fixture(scope="module")
def initial():
    return load_policy("ppo", env="ElbowArmRandom-v0")


def test_fit_comes_nearer_to_the_teacher_in_every_round(initial):
    training = Training(SETTINGS, SMALL, 0, initial)
    figures = [training.round() for _ in range(SMALL.rounds)]
    assert figures[-1]["fit"] < 0.7 * figures[0]["fit"]
    assert all(one["improved_cost"] < one["cost"] for one in figures)
    assert training.steps == SMALL.rounds * 3 * SMALL.num_envs * SETTINGS.horizon


def test_teacher_without_noise_does_what_its_labels_say(initial):
    how = replace(SMALL, rounds=1, teacher_noise=0.0, smoothing=1e-4, smoothing_final=1e-4)
    figures = Training(SETTINGS, how, 0, initial).round()
    assert -figures["taught_return"] == pytest.approx(figures["improved_cost"], rel=1e-3)


def test_policy_of_a_restored_training_is_the_same(initial):
    training, other = (Training(SETTINGS, SMALL, seed, initial) for seed in (0, 1))
    training.round()
    other.restore(training.state())
    assert other.policy({"command": ""}).card.digest == training.policy({"command": ""}).card.digest
    assert other.rounds == 1


def test_policies_of_other_observations_and_environments_that_the_teacher_does_not_know_are_refused(initial):
    with pytest.raises(ValueError, match="initial policy must observe the environment's first entries"):
        Training(SETTINGS, SMALL, 0, load_policy("ppo", env="ElbowArmTable-v0"))
    with pytest.raises(ValueError, match="heat must be off"):
        Training(replace(SETTINGS, heat=True), SMALL, 0, initial)
    with pytest.raises(ValueError, match="action_unit must be 'fraction'"):
        Training(replace(SETTINGS, action_unit="volt"), SMALL, 0, initial)


def test_stopped_run_goes_on_and_leaves_a_policy_for_its_environment(tmp_path, monkeypatch, initial):
    monkeypatch.setattr(rounds, "do_all", in_this_process)
    folder, made = tmp_path / "newton_tasks_seed5", []
    make_round = Training.round

    def stop_after_three(training):
        if len(made) == 3:
            raise KeyboardInterrupt
        made.append(training.rounds)
        return make_round(training)

    monkeypatch.setattr(Training, "round", stop_after_three)
    run = SETTINGS, ENV, initial, SMALL, {5: folder}, "command"
    with pytest.raises(KeyboardInterrupt):
        newton_all(*run)
    assert (folder / CHECKPOINT).is_file()
    monkeypatch.setattr(Training, "round", make_round)
    with pytest.raises(ValueError, match="output must be free of earlier runs"):
        newton_all(*run)
    result = newton_all(*run, resume=True)[5]
    assert made == [0, 1, 2]
    assert result["finished"]
    assert result["steps"] == 4 * 3 * SMALL.num_envs * SETTINGS.horizon
    assert len((folder / "evaluations.csv").read_text().splitlines()) == 3
    policy = read_policy(folder / "best")
    assert (policy.card.env, policy.card.algorithm, policy.card.training["seed"]) == (ENV, "newton", 5)
    assert newton_all(*run, resume=True)[5] == result

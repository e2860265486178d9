"""Plans of sweeps: every choice once, under a name of its own, and as a command line that trains the same."""

import json
import shlex

import pytest

from agents.__main__ import app
from agents.learning.command import Schedule
from agents.learning.presets import default_settings
from agents.sweep.plan import Plan

GRID = Plan(
    algorithms=("ppo", "sac"),
    elbows=(2, (4, 7)),
    settings={"gamma": [0.9, 0.95], "hidden": [[8], [8, 4]], "sac": {"batch_size": 64, "falling": False}},
    environment={"energy_weight": [0.001, 0.002]},
)


def test_every_choice_is_a_trial_with_a_name_of_its_own():
    trials = GRID.trials()
    assert len(trials) == len({trial.name for trial in trials}) == 2 * 2 * 2 * 2 * 2
    assert {trial.settings.gamma for trial in trials} == {0.9, 0.95}
    assert {trial.settings.hidden for trial in trials} == {(8,), (8, 4)}
    assert {(trial.algorithm, trial.settings.batch_size, trial.settings.falling) for trial in trials} == {
        ("ppo", default_settings("ppo", "elbows2").batch_size, True),
        ("sac", 64, False),
    }
    assert {trial.task.settings().energy_weight for trial in trials} == {0.001, 0.002}
    # Returns of other tasks or prices are no rivals.
    assert len({trial.question for trial in trials}) == 2 * 2


def test_trial_without_changes_has_the_name_and_the_settings_of_a_plain_training(tmp_path):
    [trial] = Plan(elbows=(1,), seeds=2).trials()
    assert trial.settings == default_settings("ppo", "elbows1")
    runs = trial.runs(Schedule(seeds=2, first_seed=3, output=tmp_path))
    assert [run.folder.name for run in runs] == ["ppo_elbows1_seed3", "ppo_elbows1_seed4"]


def test_command_line_of_a_trial_trains_its_runs(monkeypatch):
    trained = []
    monkeypatch.setattr("agents.learning.train.train_all", lambda runs, *_: trained.extend(runs))
    schedule = Schedule(seeds=1, label="swept")
    for trial in GRID.trials():
        trained.clear()
        [run] = trial.runs(schedule)
        app.run(shlex.split(run.command)[3:])
        assert [one.record() for one in trained] == [run.record()]
        assert trained[0].folder == run.folder


def test_plan_is_the_same_from_a_file(tmp_path):
    path = tmp_path / "plan.json"
    path.write_text(json.dumps(GRID.to_dict()))
    assert Plan.read(path) == GRID


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        ({"algorithms": ["dpo"]}, "algorithms must be among ppo, sac, got dpo"),
        ({"elbows": []}, "elbows must be at least one, got none"),
        ({"seeds": 0}, "seeds must be positive, got 0"),
        ({"settings": {"gamma": []}}, "gamma in settings must have at least one choice, got none"),
        ({"settings": {"gama": 0.9}}, "settings of ppo must be among total_timesteps, .*, got gama"),
        ({"settings": {"gamma": 2.0}}, r"gamma must lie in \(0, 1\], got 2.0"),
        ({"settings": {"ppo": 3}}, "ppo in settings must be an object, got 3"),
        ({"environment": {"elbows": 1}}, "--environment must hold only .*, got elbows"),
        ({"environment": {"payload": [0.1, -1.0]}}, "payload must"),
        ({"seed": 3}, "plan.json must hold only algorithms, .*, got seed"),
    ],
)
def test_what_is_refused_is_named_before_anything_trains(tmp_path, plan, message):
    path = tmp_path / "plan.json"
    path.write_text(json.dumps(plan))
    with pytest.raises(ValueError, match=message):
        Plan.read(path).runs(tmp_path)
    assert list(tmp_path.iterdir()) == [path]

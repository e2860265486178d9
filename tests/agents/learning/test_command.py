"""Command lines of train, clone and newton: parsed once, with the defaults of the task that they name."""

import json
import re
import shlex
from dataclasses import asdict, fields

import pytest

from agents.__main__ import app
from agents.learning.clone_settings import CloneSettings
from agents.learning.newton.settings import NewtonSettings
from agents.learning.presets import default_settings
from agents.shipped.seeds import shipped_path, shipped_policies
from elbow_gym.baselines.policy import read_policy


@pytest.fixture
def runs(monkeypatch):
    """The runs that a command line would train."""
    trained = []

    def keep(runs, workers, resume):
        trained.extend(runs)
        return []

    monkeypatch.setattr("agents.learning.train.train_all", keep)

    def parsed(line):
        trained.clear()
        app.run(shlex.split(line))
        return list(trained)

    return parsed


def card_of(name):
    group, _, seed = name.rpartition("_seed")
    return read_policy(shipped_path(group, int(seed))).card


@pytest.mark.parametrize(
    ("line", "algorithm", "name"),
    [
        ("train --label sac ppo", "ppo", "ppo_sac_elbows2_seed0"),
        ("train ppo --label sac", "ppo", "ppo_sac_elbows2_seed0"),
        ("train sac --label ppo --output ppo", "sac", "sac_ppo_elbows2_seed0"),
        ("train --output=sac ppo --elbows 1", "ppo", "ppo_elbows1_seed0"),
    ],
)
def test_algorithm_is_the_word_that_names_it_not_the_value_of_an_option(runs, line, algorithm, name):
    [run] = runs(line)
    assert run.algorithm == algorithm
    assert run.record()["algorithm"] == algorithm
    assert type(run.settings) is type(default_settings(algorithm, "elbows2"))
    assert run.folder.name == name
    assert run.command == f"python -m agents {line}"


@pytest.mark.parametrize(
    ("line", "algorithm", "task"),
    [
        ("train ppo", "ppo", "elbows2"),
        ("train ppo --elbows 1", "ppo", "elbows1"),
        ("train --elbows=0 ppo", "ppo", "elbows0"),
        ("train sac --seeds 1 --elbows 1", "sac", "elbows1"),
        ("train ppo --env ElbowArmTable-v0", "ppo", "table"),
        ("train --env=ElbowArmRandom-v0 ppo", "ppo", "random"),
    ],
)
def test_defaults_are_those_of_the_algorithm_and_the_task(runs, line, algorithm, task):
    [run] = runs(line)
    assert run.settings == default_settings(algorithm, task)


def test_options_change_the_defaults_they_name_and_no_other(runs):
    [run] = runs("train sac --elbows 1 --first-proximity 5 --hidden 32 16 --no-falling --critic-hidden None")
    changed = {"first_proximity": 5.0, "hidden": (32, 16), "falling": False, "critic_hidden": None}
    assert asdict(run.settings) == {**asdict(default_settings("sac", "elbows1")), **changed}


def test_seeds_have_a_run_each_with_the_environment_asked_for(runs):
    three = runs(
        """train ppo --seeds 3 --first-seed 4 --elbows 1 --environment '{"energy_weight": 0.002}' --minutes 2"""
    )
    assert [run.seed for run in three] == [4, 5, 6]
    assert [run.folder.as_posix() for run in three] == [f"runs/ppo_elbows1_seed{seed}" for seed in (4, 5, 6)]
    assert {(run.environment["energy_weight"], run.environment["elbows"], run.minutes) for run in three} == {
        (0.002, 1, 2.0)
    }
    # The card's command line gives the same when a shell splits it.
    assert shlex.split(three[0].command)[-3] == '{"energy_weight": 0.002}'


@pytest.mark.parametrize("name", [name for name in shipped_policies() if not name.startswith(("clone", "newton"))])
def test_commands_in_policy_cards_train_the_task_and_the_settings_of_the_card(runs, name):
    card = card_of(name)
    words = card.command.removeprefix("python -m agents ")
    run = next(run for run in runs(words) if run.seed == card.training["seed"])
    assert (run.algorithm, run.env) == (card.algorithm, card.env)
    known = {field.name for field in fields(run.settings)}
    recorded = {key: value for key, value in card.training.items() if key in known}
    assert json.loads(json.dumps({key: asdict(run.settings)[key] for key in recorded})) == recorded


def test_commands_in_clones_cards_clone_with_the_settings_of_the_card(monkeypatch):
    cloned = []
    monkeypatch.setattr("agents.learning.clone.clone_all", lambda *arguments: cloned.append(arguments) or {})
    for name in [name for name in shipped_policies() if name.startswith("clone")]:
        card = card_of(name)
        app.run(card.command.removeprefix("python -m agents ").split())
        settings, trajectory, how, seeds, folders, command, resume, machines = cloned.pop()
        assert card.training["seed"] in seeds
        assert name in {folder.name for folder in folders}
        assert settings.elbows == card.environment["elbows"]
        assert trajectory.is_file()
        recorded = {field.name: card.training[field.name] for field in fields(CloneSettings)}
        assert json.loads(json.dumps(asdict(how))) == recorded
        assert (command, resume, machines.ray) == (card.command, False, None)


@pytest.fixture
def improved(monkeypatch):
    """The arguments of the trainings on Newton's steps that command lines ask for."""
    trained = []
    monkeypatch.setattr("agents.learning.newton.runs.newton_all", lambda *given: trained.append(given) or {})
    return trained


def test_commands_in_cards_of_newtons_steps_train_the_task_and_the_settings_of_the_card(improved):
    for name in [name for name in shipped_policies() if name.startswith("newton")]:
        card = card_of(name)
        app.run(shlex.split(card.command.removeprefix("python -m agents ")))
        settings, env, _, how, folders, command, *_ = improved.pop()
        assert folders[card.training["seed"]].name == name
        assert (env, command) == (card.env, card.command)
        assert json.loads(json.dumps(settings.arguments)) == card.environment
        recorded = {field.name: card.training[field.name] for field in fields(NewtonSettings)}
        assert json.loads(json.dumps(asdict(how))) == recorded


@pytest.mark.parametrize(
    ("line", "folder", "leads"),
    [
        ("newton", "newton_tasks_seed0", "ElbowArmRandom-v0"),
        ("newton --elbows 1 --rounds 3", "newton_tasks_elbows1_seed0", "ElbowArm-v0"),
        ("newton --elbows 0 --env ElbowArmRandom-v0", "newton_random_elbows0_seed0", "ElbowArm-v0"),
    ],
)
def test_newton_is_led_by_the_shipped_policy_that_comes_nearest(improved, line, folder, leads):
    app.run(line.split())
    [(settings, _, initial, how, folders, *_)] = improved
    assert folders[0].name == folder
    assert initial.card.env == leads
    assert leads == "ElbowArmRandom-v0" or initial.card.environment["elbows"] == settings.elbows
    assert how.rounds == (3 if "--rounds" in line else NewtonSettings().rounds)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("train ppo --total-timesteps 0", "total_timesteps must be a positive integer, got 0"),
        ("train ppo --num-envs 0", "num_envs must be a positive integer, got 0"),
        ("train ppo --hidden 8 0", r"hidden must be positive integers, got \(8, 0\)"),
        ("train ppo --gamma 2", r"gamma must lie in \(0, 1\], got 2.0"),
        ("train sac --batch-size 0", "batch_size must be a positive integer, got 0"),
        ("train ppo --seeds 0", "--seeds must be a positive integer, got 0"),
        ("train ppo --seeds 1.5", "--seeds must be a positive integer, got 1.5"),
        ("train ppo --first-seed -1", "--first-seed must be an integer of at least 0, got -1"),
        ("train ppo --workers 0", "--workers must be a positive integer, got 0"),
        ("train ppo --env Foo-v0", "'Foo-v0' for argument '--env'. Expected one of .*ElbowArmTable-v0"),
        ("evaluate pd --env Foo-v0", "'Foo-v0' for argument '--env'. Expected one of .*ElbowArmTable-v0"),
        ("watch pd --env Foo-v0", "'Foo-v0' for argument '--env'. Expected one of .*ElbowArmTable-v0"),
        ("train ppo --elbows two", "--elbows must be a number of elbows, or joint numbers .*, got two"),
        (
            "train ppo --environment '{'",
            "--environment must be a JSON object such as '{\"duration\": 10}', got {, which is no JSON from",
        ),
        ("train ppo --environment 3", "--environment must be a JSON object such as '{\"duration\": 10}', got 3"),
        ("train --gamma 0.9 ppo", "--gamma must come after ppo or sac"),
        ("train dpo", "dpo; known: ppo, sac"),
        ("train", "{ppo, sac}"),
        ("train ppo --gama 1", "--gama.* perhaps --gamma is meant"),
        ("clone --seeds 0", "--seeds must be a positive integer, got 0"),
        ("clone --rounds 0", "rounds must be a positive integer, got 0"),
        ("clone --teaching 0", r"teaching must lie in \(0, 1\], got 0.0"),
        ("evaluate pd --episodes 0", "--episodes must be a positive integer, got 0"),
        ("watch pd --seed -1", "--seed must be an integer of at least 0, got -1"),
    ],
)
def test_parser_refuses_a_wrong_value_in_one_line_that_names_it(runs, capsys, line, message):
    with pytest.raises(SystemExit) as end:
        runs(line)
    assert end.value.code == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert re.search(f"error: .*{message}.*; see python -m agents .* --help", said)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("""train ppo --environment '{"elbows": 1}'""", "--environment must hold only .* got elbows .*--elbows"),
        ("""train ppo --environment '{"wind": 1}'""", "--environment must hold only action_unit, .* got wind"),
        ("""train ppo --environment '{"duration": -1}'""", "duration must be positive, got -1"),
        (
            "train ppo --elbows 11",
            r"elbows must be joints 3 to 10 \(joints 1 and 2 sit on the base\), got 11 in \(11,\)",
        ),
        ("evaluate pd --arm nowhere.json", "arm must be a JSON file of an arm, got nowhere.json: .*No such file"),
        ("train ppo --minutes 0", "minutes must be positive, got 0.0"),
        ("train ppo --checkpoint-seconds -1", "checkpoint_seconds must be finite and not negative, got -1.0"),
        ("train ppo --initial-policy nowhere", "--initial-policy must be the path of a policy's files, got nowhere"),
        ("newton --elbows 4,7", r"--initial-policy must be given for the elbows \(4, 7\), got None"),
        ("evaluate", "WHAT must be at least one of pd_paper, .*ppo.*, or the folder of a run, .*module:callable"),
        ("publish", "runs must be at least one folder of a finished training, got none"),
    ],
)
def test_command_refuses_a_wrong_value_before_it_trains(runs, line, message):
    with pytest.raises(SystemExit, match=f"^error: {message}"):
        runs(line)

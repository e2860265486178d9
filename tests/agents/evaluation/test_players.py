"""The registry of players: one name a player everywhere, one place to make a player from any controller."""

import numpy as np
import pytest

from agents.evaluation import players
from agents.evaluation.players import (
    CLASSICAL,
    ELBOW_COUNTS,
    PLANNERS,
    Entry,
    entries,
    find_player,
    known_names,
    player_of,
)
from agents.evaluation.regimes import in_all_regimes
from agents.shipped.seeds import load_policy
from agents.style import CONTROLLER_COLOURS, CONTROLLER_MARKERS, CONTROLLER_NAMES, SPARE_COLOURS
from elbow_gym.baselines.pd import PDController
from elbow_gym.baselines.policy import BASELINES
from elbow_gym.suite import ENV
from elbow_gym.table import TableParameters
from elbow_gym.task.settings import Settings
from elbow_gym.vector_env import ElbowArmVectorEnv


def test_every_classical_controller_plays_at_every_elbow_count_and_no_entry_is_there_twice():
    found = entries()
    assert len(found) == len(set(found))
    assert {(entry.name, entry.elbows) for entry in found} >= {(name, k) for name in CLASSICAL for k in ELBOW_COUNTS}


@pytest.mark.parametrize("entry", entries(), ids=lambda entry: f"{entry.name}-{entry.bearing}")
def test_the_command_line_finds_each_player_under_its_name_in_the_tables(entry):
    player = entry.player()
    found = find_player(entry.name, entry.elbows, entry.env)
    assert (found.name, found.settings, found.identity) == (entry.name, player.settings, player.identity)
    assert player.identity
    assert player.task == (f"elbows{entry.elbows}" if entry.bearing != "table" else "table")
    look = CONTROLLER_NAMES[entry.name], CONTROLLER_COLOURS[entry.name], CONTROLLER_MARKERS[entry.name]
    assert (player.label, player.colour, player.marker) == look


def test_controllers_that_look_alike_cannot_be_told_apart():
    names = {entry.name for entry in entries()}
    for table in (CONTROLLER_NAMES, CONTROLLER_COLOURS, CONTROLLER_MARKERS):
        assert len({table[name] for name in names}) == len(names)


def test_the_papers_pd_plays_with_24_volts_at_2_khz_and_without_a_limit_at_10_khz():
    clipped, unlimited = find_player("pd", 1).settings, find_player("pd_paper", 1).settings
    assert (clipped.voltage_limit, clipped.control_frequency, clipped.elbows) == (24.0, 2000.0, 1)
    assert (unlimited.voltage_limit, unlimited.control_frequency, unlimited.elbows) == (1000.0, 10_000.0, 1)


def test_entry_has_a_player_for_each_training_seed_and_plays_the_best_unless_asked():
    entry = Entry("ppo", 2)
    seeds = [entry.player(seed).seed for seed in entry.seeds]
    assert seeds == entry.seeds
    assert len({entry.player(seed).identity for seed in seeds}) == len(seeds) > 1
    assert entry.player().identity == load_policy("ppo", elbows=2).card.digest
    assert Entry("pd", 2).seeds == [None]


def test_policy_is_found_by_its_path_and_brings_its_environment():
    path = next(BASELINES.glob("*.json")).with_suffix("")
    player = find_player(str(path))
    assert player.settings == load_policy(path).settings
    assert player.label == path.name


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("nobody", 2),
            r"player must be one of .*'pd'.*'lqr'.*'ppo'.* in elbows2, or the folder of .*:callable, got 'nobody'",
        ),
        (("lqr", 5), "elbows of the LQR must be a count with an optimal trajectory, got 5: no elbows5.npz"),
        (("pd", 9), "elbows must be .*, got 9"),
        (("pd", 2, "Pendulum-v1"), "env must be one of .*, got 'Pendulum-v1'"),
    ],
)
def test_unknown_player_is_a_value_error_that_names_it(arguments, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        find_player(*arguments)


def test_policy_refuses_other_elbows_than_those_of_its_training():
    path = next(BASELINES.glob("*_elbows2_*.json"))
    with pytest.raises(ValueError, match=r"^elbows must be 2 as in the policy's training, got 1"):
        find_player(str(path), 1)


def test_policies_of_drawn_tasks_play_there_under_a_name_of_their_own(monkeypatch):
    names = ["ppo_tasks_seed0", "ppo_tasks_seed1", "clone_wide_tasks_elbows1_seed3", "ppo_elbows2_seed0"]
    monkeypatch.setattr(players, "shipped_policies", lambda: names)
    found = {Entry("ppo_tasks", 2, ENV): "ppo_tasks", Entry("clone_wide_tasks", 1, ENV): "clone_wide_tasks_elbows1"}
    assert players.learned() == {**found, Entry("ppo", 2): "ppo_elbows2"}
    assert not set(found) & set(entries())
    assert "ppo_tasks" in known_names(2, ENV)
    assert "ppo_tasks" not in known_names(2)


class Idle:
    """A controller that lets the arm fall."""

    def predict(self, observation, *_args, **_kwargs):
        return np.zeros((len(observation), 10), dtype=np.float32), None


def test_any_maker_of_a_controller_makes_a_player():
    settings = Settings(elbows=0, duration=2.1)
    player = player_of("idle", settings, lambda _: Idle())
    assert (player.label, player.marker, player.task) == ("idle", "o", "elbows0")
    assert player.colour in SPARE_COLOURS
    results = in_all_regimes(player, [1, 2])
    # No voltage and what moves the joints turns the motors into brakes: nothing is drawn from the supply.
    np.testing.assert_allclose(results["A"]["drawn_energy"], 0.0)
    assert (results["A"]["error_rms"] > 100.0).all()


def test_lqr_follows_the_trajectory_from_the_start_that_the_environment_has():
    player = find_player("lqr", 2)
    apart = []
    for start in ("paper", "on_target"):
        env = ElbowArmVectorEnv(1, **{**player.settings.arguments, "start": start, "start_noise": 0.0})
        observation, _ = env.reset(seed=0)
        action, _ = player.make(env).predict(observation)
        planned = np.load(players.optimal_trajectory(2, start))["voltage"][0]
        np.testing.assert_allclose(action[0] * 24.0, planned, atol=1e-3)
        apart.append(planned)
    assert not np.allclose(*apart)


def test_classical_player_on_the_table_resolves_its_contacts():
    player = find_player("computed_torque", env=players.TABLE_ENV)
    assert player.settings.table is True
    # The lightest free link is the hand's: a thin rod opposes a quarter of its mass to a force on its end.
    arm, table = player.settings.parsed_arm, TableParameters()
    fastest = np.sqrt(table.stiffness / (min(link.mass for link in arm.links[1:]) / 4.0))
    assert fastest * player.settings.substeps.max() < 1.0
    clipped = find_player("pd", env=players.TABLE_ENV)
    assert isinstance(clipped.make(ElbowArmVectorEnv(1, **clipped.settings.arguments)), PDController)


@pytest.mark.parametrize("name", PLANNERS)
def test_planners_are_found_by_name_and_play_with_the_policies_but_not_with_everybody(name):
    assert name in known_names(1)
    assert name not in {entry.name for entry in entries()}
    player = find_player(name, 1, arguments={"payload": 0.1})
    assert player.settings == Settings(elbows=1, payload=0.1)
    assert player.identity.startswith(name)
    assert Entry(name, 1).player().settings == Settings(elbows=1)
    others = {entry.name for entry in entries()} | set(PLANNERS) - {name}
    for table in (CONTROLLER_NAMES, CONTROLLER_COLOURS, CONTROLLER_MARKERS):
        assert table[name] not in {table[other] for other in others}

"""The environment's page: its tables and lists say what the code has."""

import ast
import dataclasses
import inspect
import math
import re

import numpy as np
import pytest

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv
from elbow_gym.kinematics import elbow_heights
from elbow_gym.task.observation import FEATURES, SWITCHED_FEATURES, TASK_FEATURES, ObservationLayout
from elbow_gym.task.settings import Settings

PAGE = inspect.getdoc(ElbowArmEnv)


def table(section):
    """Rows of the section's Markdown table, as lists of cells, without its head."""
    lines = PAGE.split(f"## {section}\n")[1].split("\n## ")[0].splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    return rows[2:]


def test_page_has_gymnasiums_sections_in_order():
    heads = [line[3:] for line in PAGE.splitlines() if line.startswith("## ")]
    assert heads == [
        "Description",
        "Action Space",
        "Observation Space",
        "Rewards",
        "Starting State",
        "Episode End",
        "Arguments",
        "Version History",
    ]


def test_observation_table_is_the_features():
    rows = [
        (name, unit, float(scale), float(limit), meaning)
        for name, _, unit, scale, limit, meaning in table("Observation Space")
    ]
    assert rows == [feature[:5] for feature in (*FEATURES, *SWITCHED_FEATURES, *TASK_FEATURES)]


@pytest.mark.parametrize("n", [3, 10])
def test_observation_table_counts_the_entries(n):
    rows = table("Observation Space")[: len(FEATURES)]
    counts = tuple(n if entries == "n" else int(entries) for _, entries, *_ in rows)
    assert counts == ObservationLayout(n).sizes


def test_switched_features_have_the_entries_that_the_table_says():
    env = ElbowArmEnv(table=True, elbow_friction=0.1, heat=True, randomize={"action_delay": [0, 2]})
    sizes = dict(zip([name for name, *_ in table("Observation Space")[:10]], env.episodes.layout.sizes, strict=True))
    assert (sizes["contact_force"], sizes["temperature_rise"], sizes["pending_voltage"]) == (9, 10, 20)
    assert [entries.split(",")[0].split(" ")[0] for _, entries, *_ in table("Observation Space")[7:10]] == [
        "n-1",
        "n",
        "n",
    ]


def test_entries_of_the_task_are_as_many_as_the_table_says():
    layout = ObservationLayout(10, task=True)
    counts = tuple(int(entries.split(",")[0]) for _, entries, *_ in table("Observation Space")[10:])
    assert counts == layout.sizes[len(FEATURES) :]
    assert sum(counts) == layout.size - ObservationLayout(10).size == 19


def test_switches_add_the_info_keys_that_the_page_names():
    switches = {"table": True, "elbow_friction": 0.1, "heat": True, "supply_resistance": 0.1}
    env = ElbowArmEnv(**switches, randomize={"payload": [0.0, 0.1]})
    drawn = env.reset(seed=0)[1]
    more = {"contact_force", "load_bearing", "contact_loss", "temperature_rise", "overheated", "supply_loss"}
    assert set(drawn) - set(ElbowArmEnv().reset(seed=0)[1]) == {*more, "parameters"}
    paragraph = PAGE.split("A table adds ")[1].split("\n\n")[0]
    assert all(key in paragraph for key in (*more, "parameters"))


def test_arguments_table_is_the_settings_with_their_defaults():
    rows = {name: ast.literal_eval(default) for name, default, _ in table("Arguments")}
    fields = {field.name: field.default for field in dataclasses.fields(Settings)}
    assert list(rows) == list(fields)
    assert rows == fields


@pytest.mark.parametrize("kind", [ElbowArmEnv, ElbowArmVectorEnv])
def test_signatures_repeat_the_settings_defaults(kind):
    fields = {field.name: field.default for field in dataclasses.fields(Settings)}
    given = {name: argument.default for name, argument in inspect.signature(kind).parameters.items() if name in fields}
    assert set(given) >= {"elbows", "arm"}
    assert given == {name: fields[name] for name in given}


def test_action_table_covers_every_joint_within_the_action_space():
    first, rest = table("Action Space")
    assert (first[0], rest[0]) == ("0", "1..n-1")
    space = ElbowArmEnv().action_space
    assert (float(first[2]), float(first[3])) == (space.low[0], space.high[0])
    assert (float(rest[2]), float(rest[3])) == (space.low[1:].min(), space.high[1:].max())


def test_every_info_key_is_documented_with_its_unit():
    _, info = ElbowArmEnv().reset(seed=0)
    sentence = PAGE.split("`info` holds ")[1].split("\n\n")[0]
    units = {
        "tracking_error": "[m]",
        "electrical_power": "[W]",
        "electrical_energy": "[J]",
        "drawn_energy": "[J]",
        "link_work": "[J]",
        "voltage": "[V]",
        "voltage_command": "[V]",
        "elbow_force": "[N]",
        "constraint_residual": "[m/s^2]",
        "below_table": "[s]",
    }
    assert set(info) == {*units, "reward_tracking", "reward_energy"} == set(re.findall(r"\w+_\w+|voltage", sentence))
    for key, unit in units.items():
        assert re.search(rf"\b{key}\b[^\[]*(\[[\w/^]+\])", sentence)[1] == unit


@pytest.mark.parametrize(
    ("settings", "error"),
    [
        ({}, math.dist((2.17279, 0.0, 0.42426), (1.6, 1.5, 0.4))),
        ({"start": "on_target"}, 0.0),
        ({"start": "on_target", "circle": {"phase": "random"}}, 0.0),
    ],
)
def test_noiseless_start_is_the_papers_pose_or_on_the_target(settings, error):
    _, info = ElbowArmEnv(start_noise=0.0, **settings).reset(seed=1)
    assert info["tracking_error"] == pytest.approx(error, abs=1e-5)


def test_start_noise_spreads_the_pose_and_keeps_the_elbows_on_the_table():
    env = ElbowArmEnv(start_noise=0.1)
    pose = np.array(env.settings.parsed_arm.nominal_pose)
    poses = np.array([env.decode(env.reset(seed=seed)[0])["joint_angle"] + pose for seed in range(40)])
    np.testing.assert_allclose(elbow_heights(env.settings.parsed_arm, poses, (4, 7)), 0.0, atol=1e-6)
    np.testing.assert_allclose(poses[:, [0, 8, 9]].std(axis=0), 0.1, rtol=0.3)

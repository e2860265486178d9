"""Refusals of the bound by name, and tasks that are the same question."""

from dataclasses import replace

import numpy as np
import pytest

from agents.optimal.problem import Problem
from elbow_gym import paper_arm
from elbow_gym.env import ElbowArmEnv
from elbow_gym.task.settings import Settings

REFUSED = {
    "table must be off": {"table": True},
    "elbow_friction must be off": {"elbow_friction": 0.1},
    "gear_coulomb_friction must be off": {"gear_coulomb_friction": 1e-4},
    "heat must be off": {"heat": True},
    "supply_resistance must be off": {"supply_resistance": 0.1},
    "randomize must be off": {"randomize": {"mass": [0.9, 1.1]}},
    "regeneration must be True": {"regeneration": False},
    "circle must be fixed .* random radius, phase": {"circle": {"radius": [0.05, 0.1], "phase": "random"}},
}


@pytest.mark.parametrize("said", REFUSED)
def test_what_the_program_does_not_know_is_refused_by_name(said):
    with pytest.raises(ValueError, match=said):
        Problem(Settings(**REFUSED[said]))


def test_a_path_below_the_table_is_refused_where_joints_must_stay_above():
    settings = Settings(elbows=0, circle={"center": [1.5, 1.5, -0.2]})
    assert Problem(settings).target[:, 2].max() < 0.0
    with pytest.raises(ValueError, match=r"above_table must be False where the path is below the table, got -0\.2 m"):
        Problem(settings, above_table=True)


@pytest.mark.parametrize(
    ("elbows", "start"), [(0, "paper"), (2, "paper"), ((5,), "paper"), (0, "on_target"), (2, "on_target")]
)
def test_start_is_the_environments(elbows, start):
    settings = Settings(elbows=elbows, start=start, start_noise=0.0)
    env = ElbowArmEnv(**settings.arguments)
    env.reset(seed=0)
    state = env.get_state()["episodes"]["simulator"]["state"][0]
    np.testing.assert_allclose(Problem(settings).start, state[0], rtol=0.0, atol=1e-12)


def test_question_is_of_what_the_solution_depends_on():
    asked = Problem(Settings()).question
    for same in ({"start_noise": 0.1}, {"timestep": 0.001}, {"elbows": (4, 7)}, {"circle": {"radius": 0.1}}):
        assert Problem(Settings(**same)).question == asked
    turned = replace(paper_arm(), nominal_pose=(0.1, *paper_arm().nominal_pose[1:]))
    for other in ({"payload": 0.1}, {"circle": {"phase": 0.1}}, {"energy_weight": 0.002}, {"arm": turned}):
        assert Problem(Settings(**other)).question != asked

"""Draws in infos: copies that are made when somebody looks, of the episode that the info is of."""

import copy
import pickle

import numpy as np
import pytest

from elbow_gym import ElbowArmEnv
from elbow_gym.task.draws import Copies

SETTINGS = {"randomize": {"mass": [0.8, 1.2], "payload": [0.0, 0.3]}, "circle": {"radius": [0.1, 0.15]}}


def fresh():
    source = {"mass": np.arange(3.0), "payload": np.float64(0.2)}
    copies = Copies()
    copies.source = source
    return copies, source


LOOKS = {
    "get": lambda copies: copies.get("mass"),
    "item": lambda copies: copies["mass"],
    "items": lambda copies: dict(copies.items())["mass"],
    "values": lambda copies: next(iter(copies.values())),
    "dict": lambda copies: dict(copies)["mass"],
    "unpacked": lambda copies: {**copies}["mass"],
    "merged": lambda copies: (copies | {})["mass"],
    "merged into another": lambda copies: ({} | copies)["mass"],
    "update": lambda copies: (other := {}, other.update(copies))[0]["mass"],
    "copy": lambda copies: copies.copy()["mass"],
    "pop": lambda copies: copies.pop("mass"),
    "setdefault": lambda copies: copies.setdefault("mass", None),
    "shallow copy": lambda copies: copy.copy(copies)["mass"],
    "deep copy": lambda copies: copy.deepcopy(copies)["mass"],
    "pickle": lambda copies: pickle.loads(pickle.dumps(copies))["mass"],
}


@pytest.mark.parametrize("look", LOOKS.values(), ids=LOOKS)
def test_whoever_looks_finds_copies(look):
    copies, source = fresh()
    found = look(copies)
    np.testing.assert_array_equal(found, source["mass"])
    assert not np.shares_memory(found, source["mass"])


def test_they_answer_as_a_dict_does_before_anybody_has_looked():
    assert len(fresh()[0]) == 2
    assert fresh()[0]
    assert list(fresh()[0]) == list(reversed(fresh()[0]))[::-1] == ["mass", "payload"]
    assert "mass" in fresh()[0]
    assert repr(fresh()[0]) == repr(fresh()[1])
    assert fresh()[0] != {}
    assert fresh()[0].keys() == {"mass", "payload"}
    changed = fresh()[0]
    changed["mass"] = 1.0
    del changed["payload"]
    assert changed == {"mass": 1.0}
    changed = fresh()[0]
    changed.clear()
    assert changed == {}


def test_an_info_keeps_the_draws_of_its_own_episode_and_shares_none():
    env = ElbowArmEnv(**SETTINGS)
    _, first = env.reset(seed=1)
    *_, later = env.step(env.action_space.sample())
    expected = env.episodes.population.values["mass"][0].copy()
    # Nobody has looked at these two before the next episode.
    env.reset(seed=2)
    for info in (first, later):
        np.testing.assert_array_equal(info["parameters"]["mass"], expected)
        assert isinstance(info["parameters"]["payload"], np.float64)
    assert (
        first["circle"].keys()
        == later["circle"].keys()
        == {*("center", "radius", "period", "tilt", "tilt_axis", "phase", "rate")}
    )
    assert not np.shares_memory(first["parameters"]["mass"], later["parameters"]["mass"])
    later["parameters"]["mass"][:] = 0.0
    np.testing.assert_array_equal(env.reset(seed=1)[1]["parameters"]["mass"], expected)


def test_a_restored_state_brings_its_draws():
    env = ElbowArmEnv(**SETTINGS)
    _, drawn = env.reset(seed=1)
    state = env.get_state()
    env.reset(seed=2)
    env.set_state(state)
    *_, info = env.step(np.zeros(10, np.float32))
    np.testing.assert_array_equal(info["parameters"]["mass"], drawn["parameters"]["mass"])
    assert info["circle"]["radius"] == drawn["circle"]["radius"]

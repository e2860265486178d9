"""The compliant table's parameters: their forms, and what is refused."""

import json
import math

import pytest

from elbow_gym import TableParameters
from elbow_gym.table import as_table


def test_a_table_is_none_the_default_a_dict_or_itself():
    table = TableParameters(stiffness=2e4, friction=0.3)
    assert as_table(False) is None
    assert as_table(True) == as_table({}) == TableParameters()
    assert as_table({"friction": 0.3, "stiffness": 2e4}) == as_table(table) == table


def test_table_survives_json():
    table = TableParameters(stiffness=3e5, dissipation=0.0, friction=0.7, friction_velocity=0.02)
    assert as_table(json.loads(json.dumps(table.to_dict()))) == table


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"stiffness": 0.0}, r"table stiffness must be positive, got 0\.0"),
        ({"friction_velocity": -0.01}, r"table friction_velocity must be positive, got -0\.01"),
        ({"dissipation": -1}, "table dissipation must not be negative, got -1"),
        ({"friction": 1.01}, r"table friction must be at most 1, above which contacts jam in common poses, got 1\.01"),
        ({"friction": math.nan}, "table friction must be finite, got nan"),
        ({"friction": "rough"}, "table friction must be a number, got 'rough'"),
        ({"colour": "oak"}, r"table must have only the entries \[.*\], got 'colour'"),
        (1, "table must be True, False, a dict of its fields or TableParameters, got 1"),
        (None, "table must be True, .*, got None"),
    ],
)
def test_what_is_no_table_is_refused_in_words(entry, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        as_table(entry)

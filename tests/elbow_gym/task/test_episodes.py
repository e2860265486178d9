"""The engine under both environments: what a reset leaves behind, and what it refuses."""

import numpy as np
import pytest

from elbow_gym.task.episodes import Episodes
from elbow_gym.task.settings import Settings


def started(**arguments):
    episodes, generator = Episodes(Settings(duration=1.0, **arguments)), np.random.default_rng(0)
    episodes.reset([generator])
    return episodes, generator


def test_a_reset_forgets_the_energy_that_was_paid():
    episodes, generator = started(start_noise=0.0)
    action = np.full((1, 10), 0.3)
    first = episodes.step(action).info["electrical_power"]
    episodes.step(action)
    episodes.reset([generator])
    assert episodes.step(action).info["electrical_power"] == first > 0.0


def test_a_path_with_other_rows_is_refused_with_the_generator_as_it_was():
    episodes, generator = started()
    before = generator.bit_generator.state
    with pytest.raises(ValueError, match=r"^circle must have a shape of 3 path rows, got one of 5$"):
        episodes.reset([generator], options={"circle": {"shape": "figure_eight"}})
    assert generator.bit_generator.state == before


@pytest.mark.parametrize(("unit", "highest", "volts"), [("fraction", 1.0, 20.0), ("volt", 20.0, 1.0)])
def test_an_action_is_a_share_of_the_supply_or_volts(unit, highest, volts):
    episodes, _ = started(action_unit=unit, voltage_limit=20.0)
    assert (episodes.highest_action, episodes.volts_per_action) == (highest, volts)


def test_prices_are_those_that_were_set():
    episodes, _ = started(tracking_weight=2.0)
    episodes.energy_weight = 0.5
    assert (episodes.tracking_weight, episodes.energy_weight) == (2.0, 0.5)

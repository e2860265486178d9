"""Checks of arguments: what passes comes back in its plain type, what does not is named with the rule and the value."""

import numpy as np
import pytest

from elbow_gym.checks import as_batch, as_numbers, positive_integer, require_entries, restore


def test_restore_copies_into_the_same_arrays():
    q, steps = np.zeros((2, 3)), np.zeros(2, dtype=np.int64)
    restore({"q": q, "steps": steps}, {"q": np.ones((2, 3)), "steps": np.array([4, 5]), "more": None})
    np.testing.assert_array_equal(q, np.ones((2, 3)))
    np.testing.assert_array_equal(steps, [4, 5])


@pytest.mark.parametrize(("saved", "got"), [({}, "nothing"), ({"steps": np.zeros(3)}, r"\(3,\)")])
def test_restore_changes_nothing_unless_everything_fits(saved, got):
    q, steps = np.zeros((2, 3)), np.zeros(2)
    with pytest.raises(ValueError, match=rf"^state\['steps'\] must have shape \(2,\), got {got}$"):
        restore({"q": q, "steps": steps}, {"q": np.ones((2, 3)), **saved})
    np.testing.assert_array_equal(q, np.zeros((2, 3)))


def test_one_row_stands_for_every_arm():
    np.testing.assert_array_equal(as_batch("q", [1, 2, 3], (2, 3)), [[1.0, 2.0, 3.0]] * 2)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ([1.0, np.nan, 3.0], r"^q must be finite, got nan$"),
        ([1.0, 2.0], r"^q must have shape \(2, 3\) or \(3,\), got \(2,\)$"),
        ("up", r"^q must be numbers of shape \(2, 3\) or \(3,\), got 'up'$"),
    ],
)
def test_batch_that_is_not_one_is_refused(value, message):
    with pytest.raises(ValueError, match=message):
        as_batch("q", value, (2, 3))


def test_numbers_are_contiguous_doubles():
    array = as_numbers("action", np.asfortranarray(np.ones((2, 3), dtype=np.float32)), (2, 3))
    assert array.dtype == np.float64
    assert array.flags.c_contiguous


@pytest.mark.parametrize("value", [0, -1, 1.0, True, "1", None])
def test_count_must_be_a_positive_integer(value):
    with pytest.raises(ValueError, match=r"^num_envs must be a positive integer, got "):
        positive_integer("num_envs", value)
    assert positive_integer("num_envs", np.int32(3)) == 3


def test_missing_entry_is_named_with_what_is_there():
    with pytest.raises(ValueError, match=r"^arm must have the entry 'motors', got \['links'\]$"):
        require_entries({"links": 1}, ("links", "motors"), "arm")

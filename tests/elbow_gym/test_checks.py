"""Checks of arguments: what passes comes back in its plain type, what does not is named with the rule and the value."""

import numpy as np
import pytest

from elbow_gym.checks import as_batch, as_numbers, positive_integer, require_entries, saved_rows


@pytest.mark.parametrize(
    ("saved", "like", "message"),
    [
        ([[1.0, 2.0]], np.zeros((4, 3)), r"^state must have shape \(2, 3\), got \(1, 2\)$"),
        ([[1.0], [2.0, 3.0]], np.zeros((4, 3)), r"^state must have shape \(2, 3\), got \[\[1.0\], "),
        ([1.0, np.inf], np.zeros(4), "^state must be finite, got inf$"),
        ([1.0, 2.0], np.zeros(4, dtype=np.int64), "^state must have entries as int64, got float64$"),
        ([1, 0], np.zeros(4, dtype=np.bool_), "^state must have entries as bool, got int64$"),
    ],
)
def test_saved_rows_that_do_not_fit_are_refused(saved, like, message):
    with pytest.raises(ValueError, match=message):
        saved_rows("state", saved, like, 2)


def test_saved_rows_are_a_copy_of_the_right_type():
    saved = np.array([4, 5], dtype=np.int32)
    rows = saved_rows("state", saved, np.zeros(7), 2)
    assert (rows.dtype, rows.tolist()) == (np.float64, [4.0, 5.0])
    same = saved_rows("state", rows, np.zeros(7), 2)
    assert not np.shares_memory(same, rows)


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


@pytest.mark.parametrize("value", [0, -1, 1.0, True, "1", None, 2**31 + 1, pytest.param(10**5000, id="huge")])
def test_count_must_be_a_positive_integer(value):
    with pytest.raises(ValueError, match=r"^num_envs must be a positive integer, got "):
        positive_integer("num_envs", value)
    assert positive_integer("num_envs", np.int32(3)) == 3


def test_missing_entry_is_named_with_what_is_there():
    with pytest.raises(ValueError, match=r"^arm must have the entry 'motors', got \['links'\]$"):
        require_entries({"links": 1}, ("links", "motors"), "arm")

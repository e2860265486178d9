"""Stored cells of the energy benchmark: read as they were written, and measured again where they are damaged."""

import numpy as np
import pytest

from benchmarks.energy import cache

RESULTS = {
    "A": {"return": np.array([-30.0, -31.0]), "smallest_elbow_force": np.full(2, np.nan)},
    "B": {"joint_energy": np.arange(20.0).reshape(2, 10)},
}


def same(found):
    np.testing.assert_equal(found, RESULTS)
    return True


def test_cell_comes_back_and_a_run_without_elbows_has_no_elbow_force(tmp_path, capsys):
    assert cache.load("key", tmp_path) is None
    cache.store("key", RESULTS, tmp_path)
    assert same(cache.load("key", tmp_path))
    assert capsys.readouterr().err == ""


def test_cell_that_is_cut_or_flipped_is_measured_again(tmp_path, capsys):
    cache.store("key", RESULTS, tmp_path)
    path, rng = tmp_path / "key.npz", np.random.default_rng(0)
    whole = path.read_bytes()
    for place in rng.integers(len(whole), size=60):
        path.write_bytes(whole[:place])
        assert cache.load("key", tmp_path) is None
        assert "key.npz must be an .npz file as it was written" in capsys.readouterr().err
        flipped = bytearray(whole)
        flipped[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        found = cache.load("key", tmp_path)
        assert "; it is measured again" in capsys.readouterr().err if found is None else same(found)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_cell_that_holds_no_number_is_measured_again(tmp_path, capsys, value):
    cache.store("key", {**RESULTS, "C": {"return": np.array([1.0, value])}}, tmp_path)
    assert cache.load("key", tmp_path) is None
    assert f"key.npz must hold finite numbers, got {value} in C/return; it is measured" in capsys.readouterr().err

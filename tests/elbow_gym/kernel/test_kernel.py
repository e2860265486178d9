"""The compiled core: its sine, Pinocchio's accelerations, and the same bits whatever the block or the compiler."""

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from elbow_gym import kinematics
from elbow_gym.kernel.build import kernel
from elbow_gym.kernel.rows import BELOW_TABLE, SUMMARY_COLUMNS
from elbow_gym.kernel.sine import sincos
from elbow_gym.kernel.slots import BLOCK_LANES
from elbow_gym.kernel.template import compiled
from elbow_gym.simulation.parameter_rows import parameter_table
from tests.support.kernel_calls import ELBOWS, accelerations, advanced, batch, states

ROOT = Path(__file__).parents[3]
VECTORS = np.load(ROOT / "tests" / "vectors" / "forward_dynamics_vectors.npz")


@given(st.floats(-9.9e4, 9.9e4))
def test_sine_and_cosine_are_the_librarys_to_the_last_bit_or_two(angle):
    assert sincos(angle) == pytest.approx((math.sin(angle), math.cos(angle)), rel=0.0, abs=2.3e-16)


def test_sine_and_cosine_hold_in_every_quadrant_and_at_its_edges():
    edges = np.arange(-60000, 60000, 7) * (np.pi / 4.0)
    angles = np.concatenate([edges, np.nextafter(edges, np.inf), np.linspace(-10.0, 10.0, 4001)]).tolist()
    found, wanted = [sincos(angle) for angle in angles], [(math.sin(angle), math.cos(angle)) for angle in angles]
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=2.3e-16)


def test_sine_keeps_its_digits_near_its_zeros():
    angles = (np.arange(1.0, 30000.0, 7.0) * np.pi).tolist()
    wanted = [math.sin(angle) for angle in angles]
    np.testing.assert_allclose([sincos(angle)[0] for angle in angles], wanted, rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("lanes", [1, BLOCK_LANES])
@pytest.mark.parametrize("elbows", [0, 1, 2])
def test_accelerations_and_elbow_forces_are_pinocchios(arm, lanes, elbows):
    state = states(VECTORS["q"], VECTORS["qd"], VECTORS["i"])
    parameters = np.repeat(parameter_table(arm)[None], 60, axis=0)
    found = accelerations(lanes, state, parameters, VECTORS["v"], ELBOWS[:elbows])
    for value, name in zip(found, ("qdd", "fn", "idot"), strict=True):
        expected = VECTORS[f"{name}_e{elbows}"]
        scale = np.abs(expected).max(axis=1, initial=0.0)[:, None]
        assert (np.abs(value - expected) <= 1e-10 * scale).all()


@pytest.mark.parametrize("elbows", [(), (3,), (4, 7), (3, 5, 8, 10)])
@pytest.mark.parametrize("size", [1, 15, 16, 40])
def test_lane_count_changes_no_bit_of_the_accelerations(size, elbows):
    for one, many in zip(*(accelerations(lanes, *batch(size), elbows) for lanes in (1, 16)), strict=True):
        np.testing.assert_array_equal(one, many)


@pytest.mark.parametrize("size", [1, 7, 16, 17, 40])
def test_lane_count_and_batch_size_change_no_bit_of_a_run(size):
    one = advanced(1, size)
    assert np.isfinite(one).all()
    np.testing.assert_array_equal(one, advanced(16, size))
    np.testing.assert_array_equal(one, advanced(16, 40)[:size])


def test_an_uncompiled_kernel_of_odd_width_gives_the_same_bits():
    script = "from tests.support.kernel_calls import advanced; print(advanced(3, 4, n_steps=2).tobytes().hex())"
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    run = [sys.executable, "-W", "error", "-c", script]
    done = subprocess.run(run, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == advanced(1, 4, n_steps=2).tobytes().hex()


def test_only_the_arms_asked_for_move():
    state, parameters, voltage = batch(40)
    before, summary = state.copy(), np.zeros((40, SUMMARY_COLUMNS))
    kernel(16).advance(state, parameters, voltage, np.zeros(0, np.int64), np.full(3, 0.001), summary, 5, 23)
    moved = (state != before).any(axis=(1, 2))
    np.testing.assert_array_equal(np.flatnonzero(moved), np.arange(5, 23))
    np.testing.assert_array_equal(np.flatnonzero(summary.any(axis=1)), np.arange(5, 23))


@pytest.mark.parametrize("lanes", [1, 16])
@pytest.mark.parametrize("volts", [1e300, 1e7])
def test_an_arm_that_blows_up_keeps_its_state_and_spares_its_neighbours(lanes, volts):
    state, parameters, voltage = batch(7)
    voltage[3] = volts
    before, summary = state.copy(), np.full((7, SUMMARY_COLUMNS + 2), 7.0)
    summary[:, BELOW_TABLE] = 0.0
    invalid = kernel(lanes).advance(state, parameters, voltage, np.array(ELBOWS), np.full(20, 0.001), summary, 0, 7)
    assert invalid == 1
    np.testing.assert_array_equal(state[3], before[3])
    np.testing.assert_array_equal(summary[3], [7.0, 7.0, 7.0, 7.0, 0.0, 0.0, 7.0, 7.0, 7.0])
    found, expected = np.concatenate([state.reshape(7, -1), summary], axis=1), advanced(lanes, 7)
    np.testing.assert_array_equal(np.delete(found, 3, axis=0), np.delete(expected, 3, axis=0))


def test_elbows_that_cannot_move_leave_the_rest_finite(arm):
    # Upright, no torque moves joint 4 up or down: W = 0 and the reference form has no solution.
    parameters, upright = parameter_table(arm)[None], np.zeros((1, 10))
    q_ddot, force, _ = accelerations(1, states(upright, upright, upright), parameters, upright, (4,))
    np.testing.assert_array_equal(q_ddot, upright)
    assert force == [[0.0]]


def test_settling_a_horizontal_link_is_a_turn_of_its_joint(arm):
    q = np.array([[0.3, 1.2, 0.5, *np.zeros(7)]])
    kernel(1).project_poses(q, parameter_table(arm)[None], np.array([3]))
    # Joint 3 comes down as link 2 turns to 90 degrees; link 3 keeps its absolute pitch.
    np.testing.assert_allclose(q[0, :4], [0.3, np.pi / 2.0, 1.7 - np.pi / 2.0, 0.0], atol=1e-15)


@pytest.mark.parametrize("lanes", [1, 16])
def test_settling_lays_elbows_on_the_plane_by_the_least_change_of_pitch(arm, lanes):
    start = arm.nominal_pose + 1e-5 * np.random.default_rng(2).normal(size=(5, 10))
    q = start.copy()
    kernel(lanes).project_poses(q, np.repeat(parameter_table(arm)[None], 5, axis=0), np.array(ELBOWS))
    assert np.abs(kinematics.elbow_heights(arm, q, ELBOWS)).max() < 1e-15
    # A least change has no part along the plane: it is a sum of the two heights' gradients in the absolute pitches.
    shift = (kinematics.pitches(q) - kinematics.pitches(start))[:, 1:]
    slope = np.sin(kinematics.pitches(arm.nominal_pose))[1:]
    gradients = np.array([slope * (np.arange(9) < links) for links in (2, 5)])
    assert np.abs(shift).max() > 1e-6
    np.testing.assert_allclose(shift - shift @ np.linalg.pinv(gradients) @ gradients, 0.0, atol=1e-9)


def test_what_no_folder_can_cache_is_compiled_all_the_same():
    # A function without a source file has no place in the cache, as all have none where no folder can be written.
    space = {}
    exec("def double(x):\n    return 2.0 * x", space)
    with pytest.raises(RuntimeError, match="cannot cache"):
        njit(cache=True)(space["double"])
    assert compiled(space["double"], cached=True)(3.0) == 6.0


def test_where_all_folders_are_read_only_the_kernels_functions_compile_all_the_same(monkeypatch):
    def refuse(**_):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr("numba.core.caching.tempfile.TemporaryFile", refuse)
    with pytest.raises(RuntimeError, match="cannot cache"):
        njit(cache=True)(sincos)
    sine, cosine = compiled(sincos, cached=True)(0.5)
    assert (sine, cosine) == pytest.approx((math.sin(0.5), math.cos(0.5)), rel=1e-15)

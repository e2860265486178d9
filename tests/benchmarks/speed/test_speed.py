"""The speed benchmark: its files, its peers present or missing, and, as timing tests, what must be faster than what."""

import csv
import json
import re
import sys
import time
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from gymnasium.utils import performance

from benchmarks.speed import environments, markdown, peers, precision
from benchmarks.speed import own as contenders
from benchmarks.speed import run as speed
from benchmarks.speed.rows import Row, ratios
from elbow_gym import Conditions, Simulator
from elbow_gym.dynamics import forward_dynamics


@pytest.fixture
def quick_starts(monkeypatch):
    """First steps that compile nothing."""
    monkeypatch.setattr(environments, "FIRST_STEP", "print(0.5)")


@pytest.fixture
def small_batches(monkeypatch):
    monkeypatch.setattr(contenders, "BATCH", 32)
    monkeypatch.setattr(environments, "VECTOR_ARMS", 32)


@pytest.fixture(params=[False, pytest.param(True, marks=pytest.mark.soak)], ids=["exponential steps", "all steps"])
def classical_steps(request, monkeypatch):
    """Whether what takes classical steps does: no other test compiles their kernels."""

    def exponential(*given, integrator, **how):
        return Simulator(*given, **how)

    if not request.param:
        monkeypatch.setattr(contenders, "OWN_STEPS", dict.fromkeys(contenders.OWN_STEPS, "exponential"))
        monkeypatch.setattr(precision, "Simulator", exponential)


@pytest.fixture
def no_peers(monkeypatch):
    for name in ("mujoco", "pinocchio"):
        monkeypatch.setitem(sys.modules, name, None)


@pytest.mark.slow
@pytest.mark.skipif(
    not hasattr(performance, "benchmark_vector_step"), reason="this Gymnasium has no benchmark_vector_step"
)
@pytest.mark.usefixtures("quick_starts", "small_batches", "classical_steps", "no_peers")
def test_quick_run_writes_all_own_rows_and_names_missing_peers(tmp_path, capsys, monkeypatch):
    # Copies in processes of their own are slow to start, and Gymnasium's business. Two threads of a network spin while
    # they wait for each other, here and in whatever later tests train.
    without = [
        c
        for c in speed.contenders(quick=True)
        if "AsyncVectorEnv" not in c.name and (c.family, c.threads) != (environments.SB3, 2)
    ]
    monkeypatch.setattr(speed, "contenders", lambda quick: without)
    rows = speed.speed(tmp_path, quick=True, command="python -m benchmarks speed --quick")
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *("precision.csv", "precision.md", "precision.png"),
        *("speed.csv", "speed.json", "speed.md", "speed.png", "speed_brief.md"),
    ]
    with (tmp_path / "speed.csv").open() as handle:
        written = list(csv.DictReader(handle))
    expected = [c for c in without if c.family in {contenders.OURS, contenders.PAPER, environments.SB3}]
    assert [(r["who"], r["what"], r["unit"]) for r in written] == [(c.family, c.name, c.unit) for c in expected]
    *table, empty, note = (tmp_path / "speed.md").read_text().splitlines()
    assert len(table) == len(rows) + 2
    assert not empty
    assert note.endswith(": equal cost, not equal accuracy.")
    for row in written:
        assert 0.0 < float(row["lower quartile [us]"]) <= float(row["median [us]"]) <= float(row["upper quartile [us]"])
        assert row["MuJoCo / this"] == ""
    context = json.loads((tmp_path / "speed.json").read_text())
    assert set(context["skipped"]) == {"MuJoCo", "Pinocchio", "Gymnasium"}
    assert context["command"] == "python -m benchmarks speed --quick"
    assert max(context["precision"]["state and energy error of as many steps of rk4"]) < 1e-10
    with (tmp_path / "precision.csv").open() as handle:
        assert {row["who"] for row in csv.DictReader(handle)} == {contenders.OURS}
    assert context["versions"]["numba"]
    assert context["machine"]["processor"]
    assert re.fullmatch(r"((AVX-512|AVX2|AVX|SSE2|NEON), \d doubles)?", context["machine"]["vectors"])
    said = capsys.readouterr().out
    for name in ("MuJoCo", "Pinocchio", "Gymnasium"):
        assert f"Skipped for want of a library: rows of {name} (" in said


def timings(*keys):
    """Best time [s] of own or peers' contenders by (family, name, unit, joints, elbows), sampled in turn."""
    table = {(c.family, c.name, c.unit, c.joints, c.elbows): c for c in speed.contenders(quick=True)}
    samplers = [table[key].make(None) for key in keys]
    return np.min([[sampler(0.02) for sampler in samplers] for _ in range(7)], axis=0)


OURS, STEP = contenders.OURS, contenders.RK4_STEP


@pytest.mark.timing
def test_an_arm_in_a_batch_costs_a_third_of_a_single_one_at_most():
    single, batch = timings((OURS, "single arm", STEP, 10, 2), (OURS, "batch", STEP, 10, 2))
    assert single > 3.0 * batch


@pytest.mark.timing
def test_forty_joints_cost_six_times_ten_at_most():
    ten, forty = timings((OURS, "batch", STEP, 10, 2), (OURS, "batch", STEP, 40, 2))
    assert forty < 6.0 * ten


@pytest.mark.timing
@pytest.mark.parametrize("elbows", [0, 2])
@pytest.mark.parametrize("num_envs", [1, 256])
def test_the_table_costs_six_tenths_more_at_most(num_envs, elbows):
    samplers = []
    for table in (False, True):
        sim = Simulator("paper", elbows, num_envs, conditions=Conditions(table=table), timestep=1e-3)
        volts = np.random.default_rng(0).uniform(-12.0, 12.0, (num_envs, 10))
        samplers.append(contenders.timed(partial(sim.step, volts, 20), 20 * num_envs))
    without, with_table = np.min([[sampler(0.02) for sampler in samplers] for _ in range(15)], axis=0)
    assert with_table < 1.6 * without


@pytest.mark.timing
def test_kernel_is_fifty_times_faster_than_the_printed_form(benchmark):
    arm, elbows = contenders.chain(10), (4, 7)
    state, volts = contenders.start_state(arm, elbows, 1), contenders.voltages(1, 10)
    evaluate, q_ddot, _ = contenders.kernel_accelerations(arm, elbows, state, volts)
    benchmark(evaluate)
    reference = []
    for _ in range(3):
        start = time.process_time()
        expected = forward_dynamics(arm, *state[0], volts[0], elbows)
        reference.append(time.process_time() - start)
    np.testing.assert_allclose(q_ddot[0], expected.q_ddot, rtol=0.0, atol=1e-8 * np.abs(expected.q_ddot).max())
    kernel = contenders.timed(lambda: [evaluate() for _ in range(100)], 100)
    assert min(reference) > 50.0 * min(kernel(0.01) for _ in range(5))


@pytest.mark.parametrize("library", [peers.MUJOCO, peers.PINOCCHIO])
@pytest.mark.parametrize("joints", [4, 10, 40])
def test_a_peers_arm_is_the_same_arm(library, joints):
    pytest.importorskip(library.lower())
    assert peers.agreement(library, joints, 0) < peers.TOLERANCE


@pytest.mark.parametrize(("joints", "elbows"), [(4, 1), (10, 2), (40, 2)])
def test_pinocchios_elbows_are_exact_and_mujocos_nearly(joints, elbows):
    pytest.importorskip("pinocchio")
    pytest.importorskip("mujoco")
    assert peers.agreement(peers.PINOCCHIO, joints, elbows) < peers.TOLERANCE
    # MuJoCo's contacts give way a little.
    assert peers.agreement(peers.MUJOCO, joints, elbows) < 0.1


def test_a_peer_with_another_arm_is_refused(monkeypatch):
    monkeypatch.setattr(peers, "agreement", lambda *_: 1e-5)
    with pytest.raises(ArithmeticError, match="MuJoCo must be the same arm to 1e-06, got 1e-05 at 10 joints"):
        peers.check_agreement()


def row(family, name, unit, microseconds, joints=10):
    contender = contenders.Contender(family=family, name=name, unit=unit, make=None, joints=joints, elbows=2)
    return Row(contender, (1e-6 * microseconds,))


def test_a_row_is_held_against_mujocos_time_for_the_same_on_the_same_arm():
    rows = [
        row(peers.MUJOCO, peers.C_LOOP, STEP, 20.0),
        row(peers.MUJOCO, "mj_forward", contenders.EVALUATION, 5.0),
        row(OURS, "single arm", STEP, 2.0),
        row(OURS, "single arm", contenders.EULER_STEP, 4.0),
        row(OURS, "single arm", contenders.EVALUATION, 1.0),
        # An environment's step holds ten RK4 steps.
        row(OURS, "environment", contenders.ENV_STEP, 100.0),
        row(OURS, "single arm", STEP, 2.0, joints=40),
    ]
    assert ratios(rows) == pytest.approx([1.0, 1.0, 10.0, 5.0, 5.0, 2.0, None])


@pytest.mark.timing
def test_peers_rows_run_and_are_held_against_mujocos_step():
    pytest.importorskip("mujoco")
    pytest.importorskip("pinocchio")
    chosen = [c for c in peers.peer_contenders() if (c.joints, c.elbows) == contenders.PAPER_CASE]
    rows, skipped = speed.measure(chosen, True, lambda *_: None)
    assert [row.contender for row in rows] == chosen
    assert not skipped
    found = {(r.contender.name, r.contender.unit): ratio for r, ratio in zip(rows, ratios(rows), strict=True)}
    assert found["C loop", STEP] == found["mj_forward", contenders.EVALUATION] == 1.0
    assert found["C loop", contenders.EULER_STEP] > 1.0
    assert found["exact elbow path", STEP] < 1.0


def test_a_sample_is_the_time_of_one_unit(monkeypatch):
    clock = iter(range(100))
    calls = []
    monkeypatch.setitem(contenders.CLOCKS, "ticks", lambda: next(clock))
    sampler = contenders.timed(lambda: calls.append(next(clock)), 10, "ticks")
    # Each call of the work takes one tick, and so does each look at the clock: 3 calls in the first 6 ticks.
    assert sampler(6.0) == pytest.approx(6.0 / (3 * 10))
    assert len(calls) == 1 + 3


@pytest.mark.parametrize(("seconds", "text"), [(2.5e-7, "0.25 us"), (1.5e-3, "1.5 ms"), (9.87, "9.87 s")])
def test_durations_are_written_with_a_fitting_unit(seconds, text):
    assert markdown.duration(seconds) == text


def test_every_kernel_that_a_contender_calls_is_compiled_before(monkeypatch):
    found = []
    monkeypatch.setattr(contenders, "_step", lambda *case: found.append(case))
    monkeypatch.setattr(contenders, "_evaluation", lambda *case: found.append(case))
    for compile_one in contenders.compilations():
        compile_one()
    case, batch = contenders.PAPER_CASE, contenders.BATCH
    steps = {(*case, arms, unit) for arms in (1, batch) for unit in ("RK4 step", "exponential step")}
    assert set(found) == steps | {(*case, 1), (*case, batch)}


def test_a_quick_run_is_not_published():
    with pytest.raises(ValueError, match="publish must be False for a quick run"):
        speed.speed(quick=True, publish=True)


def test_the_readmes_rows_are_those_of_the_papers_arm_and_mujocos_step_says_what_it_is():
    rows = [
        row(peers.MUJOCO, peers.C_LOOP, STEP, 20.0),
        row(peers.MUJOCO, peers.PYTHON_LOOP, STEP, 20.0),
        row(OURS, "batch", contenders.EXPONENTIAL_STEP, 0.5),
        row(OURS, "batch", STEP, 0.5, joints=40),
        row(environments.SB3, "64x64 net", environments.FRAME, 40.0),
    ]
    # Times on the wall are left out.
    rows.append(replace(rows[2], contender=replace(rows[2].contender, clock="wall")))
    found = [line.strip("| ").split(" | ") for line in markdown.brief(rows).splitlines()[2:]]
    assert [(line[0], line[-1]) for line in found] == [
        ("MuJoCo, C loop; equal cost, not equal accuracy", "1"),
        ("batch", "40"),
        ("64x64 net", "-"),
    ]

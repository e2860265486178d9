"""Work before processes start: each kernel is made once, with one line about the time where it takes long."""

import os
import sys
import time
from functools import partial

import pytest

from agents import workers
from agents.workers import compile_before, cores
from elbow_gym.task.settings import Settings


@pytest.fixture
def made(monkeypatch):
    """Arguments of the environments that are made, slowly and with the kernel's notice, instead of real ones."""
    found = []

    class Slow:
        def __init__(self, arms, **arguments):
            found.append((arms, arguments["elbows"], arguments["table"]))
            print("elbow_gym: compiling for this machine, once", file=sys.stderr, flush=True)
            time.sleep(0.05)

        def reset(self, seed):
            print("a warning of another kind", file=sys.stderr)

        def step(self, action):
            assert action.shape == (found[-1][0], 10)

    monkeypatch.setattr("elbow_gym.vector_env.ElbowArmVectorEnv", Slow)
    return found


def test_environments_with_the_same_kernel_are_made_once(made):
    fast = Settings(control_frequency=2000.0, timestep=5e-4, action_unit="volt", start="on_target", start_noise=0.0)
    compile_before([Settings(), fast, (Settings(), 1), Settings(table=True, elbows=0), (fast, 1)])
    assert made == [(workers.BATCH, 2, False), (1, 2, False), (workers.BATCH, 0, True)]


def test_one_line_says_how_long_it_takes_and_other_messages_stay(made, monkeypatch, capsys):
    monkeypatch.setattr(workers, "PATIENCE", 0.01)
    compile_before([Settings(), (Settings(), 1)])
    lines = capsys.readouterr().err.splitlines()
    expected = f"Compiling the kernel for this machine, once: about {2 * workers.COMPILE_SECONDS} s of CPU time."
    assert lines.count(expected) == 1
    assert sorted(lines) == sorted([expected, *["a warning of another kind"] * 2])


def test_further_kernels_are_compiled_and_counted_in_the_same_line(made, monkeypatch, capsys):
    monkeypatch.setattr(workers, "PATIENCE", 0.01)
    called = []

    def compile_one(number):
        called.append(number)
        time.sleep(0.05)

    compile_before([Settings()], {partial(compile_one, number): 3 * number for number in (1, 2)})
    assert (len(made), called) == (1, [1, 2])
    lines = [line for line in capsys.readouterr().err.splitlines() if "ompil" in line]
    assert lines == [f"Compiling the kernel for this machine, once: about {workers.COMPILE_SECONDS + 9} s of CPU time."]


def test_nothing_is_said_of_kernels_that_are_there(made, capsys):
    compile_before([Settings()])
    assert capsys.readouterr().err == "a warning of another kind\n"
    compile_before([])
    assert len(made) == 1


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no affinity on this system")
def test_cores_are_those_that_the_job_may_use():
    allowed = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(allowed)})
        assert cores() == 1
    finally:
        os.sched_setaffinity(0, allowed)
    assert cores() == len(allowed)

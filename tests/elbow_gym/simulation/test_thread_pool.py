"""Shares of a batch among threads: every arm once, errors passed on, threads that end and that a fork starts anew."""

import gc
import os
import signal
import threading
import time

import numpy as np
import pytest

from elbow_gym import ElbowArmVectorEnv, Simulator
from elbow_gym.simulation.thread_pool import Sharing

# Python 3.12 and later warn of every fork of a process with threads.
FORKS = pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")


@pytest.mark.parametrize(("arms", "lanes", "threads"), [(1, 1, 1), (5, 1, 3), (16, 16, 4), (40, 16, 2), (100, 16, 3)])
def test_every_arm_is_in_one_share_and_no_block_is_cut(arms, lanes, threads):
    shares = []

    def work(first, end):
        shares.append((first, end))
        return end - first

    assert Sharing(arms, lanes, threads).total(work) == arms
    assert len(shares) == min(threads, -(-arms // lanes))
    assert sorted(i for first, end in shares for i in range(first, end)) == list(range(arms))
    assert all(first % lanes == 0 for first, _ in shares)


def test_an_error_in_another_thread_is_raised_here():
    def work(first, end):
        if first > 0:
            raise ArithmeticError("the second share")
        return 0

    with pytest.raises(ArithmeticError, match="the second share"):
        Sharing(2, 1, 2).total(work)


def test_an_error_of_one_call_is_not_the_next_ones():
    sharing = Sharing(2, 1, 2)
    with pytest.raises(ZeroDivisionError):
        sharing.total(lambda first, _: 1 // first)
    with pytest.raises(ZeroDivisionError):
        sharing.total(lambda first, _: 1 // (1 - first))
    assert sharing.total(lambda first, _: 1 + first) == 3


def test_threads_end_with_the_arms_they_worked_for():
    before = set(threading.enumerate())
    simulator = Simulator(num_envs=40, num_threads=3)
    simulator.step(np.zeros(10))
    started = set(threading.enumerate()) - before
    assert len(started) == 2
    del simulator
    gc.collect()
    for thread in started:
        thread.join(timeout=10.0)
        assert not thread.is_alive()


def test_closing_ends_the_threads_and_the_next_call_starts_new_ones():
    before = set(threading.enumerate())
    env = ElbowArmVectorEnv(40, num_threads=3, duration=0.1)
    env.reset(seed=0)
    expected = env.step(np.zeros((40, 10)))[0]
    assert len(set(threading.enumerate()) - before) == 2
    env.close()
    env.close()
    assert set(threading.enumerate()) <= before
    env.reset(seed=0)
    np.testing.assert_array_equal(env.step(np.zeros((40, 10)))[0], expected)
    env.close()


@FORKS
def test_a_forked_process_steps_with_threads_of_its_own():
    simulator = Simulator(num_envs=40, num_threads=2)
    simulator.step(np.ones(10))
    start = simulator.get_state()
    simulator.step(np.ones(10))
    child = os.fork()
    if child == 0:
        # Without threads of its own the child would wait for ever.
        signal.alarm(60)
        expected = simulator.get_state()["state"]
        simulator.set_state(start)
        simulator.step(np.ones(10))
        os._exit(0 if np.array_equal(simulator.get_state()["state"], expected) else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    simulator.step(np.ones(10))
    assert simulator.valid.all()


@pytest.mark.parametrize("failing", [0, 2])
def test_an_error_is_raised_when_no_share_is_worked_on_any_more(failing):
    written = []

    def work(first, _):
        if first == failing:
            raise ArithmeticError(f"share {first}")
        time.sleep(0.05)
        written.append(first)
        return 0

    with pytest.raises(ArithmeticError, match=f"share {failing}"):
        Sharing(3, 1, 3).total(work)
    assert sorted(written) == [first for first in range(3) if first != failing]


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_is_raised_when_no_share_is_worked_on_any_more():
    written, main = [], threading.main_thread()

    def work(first, _):
        if threading.current_thread() is not main:
            signal.pthread_kill(main.ident, signal.SIGINT)
            time.sleep(0.1)
            written.append(first)
        return 0

    sharing = Sharing(2, 1, 2)
    with pytest.raises(KeyboardInterrupt):
        sharing.total(work)
    assert written == [1]
    assert sharing.total(lambda first, _: first) == 1

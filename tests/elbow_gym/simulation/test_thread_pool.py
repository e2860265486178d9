"""Shares of a batch among threads: every arm once, errors passed on, threads that end."""

import gc
import threading

import numpy as np
import pytest

from elbow_gym import Simulator
from elbow_gym.simulation.thread_pool import Sharing


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

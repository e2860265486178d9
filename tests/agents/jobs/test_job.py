"""Jobs: work is told once, never more often than it is worth, and ends where nobody waits for it."""

import pytest

from agents.jobs import job as module
from agents.jobs.job import Job, counted, perform


def test_units_are_told_once_each_however_the_steps_fall():
    told = []
    progress = counted(10, told.append)
    for done in (1, 2, 3, 7):
        progress(done, 7)
    assert sum(told) == 10
    assert told == [1, 1, 2, 6]


def test_messages_count_from_the_start_and_the_last_one_is_sent_whenever_it_comes(monkeypatch):
    now = iter((0.0, 0.1, 0.15, 0.3, 0.35))
    monkeypatch.setattr(module.time, "monotonic", lambda: next(now))
    sent = []

    def work(tell):
        for _ in range(4):
            tell(2)
        tell(0, "a line")
        return "done"

    # At 0 s, then 0.3 s, and with a line at once.
    assert perform(Job(work, 8), lambda *message: sent.append(message)) == "done"
    assert sent == [(2, ""), (8, ""), (8, "a line")]


def test_work_that_fails_has_sent_how_far_it_came():
    sent = []

    def work(tell):
        tell(1)
        tell(1)
        raise ValueError("wrong")

    with pytest.raises(ValueError, match="wrong"):
        perform(Job(work, 8), lambda *message: sent.append(message))
    assert sent == [(1, ""), (2, "")]


def test_work_that_nobody_waits_for_ends_with_its_next_unit_and_may_say_what_became_of_it(monkeypatch):
    wanted = iter((False, False, True))
    monkeypatch.setattr(module, "unwanted", lambda: next(wanted))
    done, sent = [], []

    def work(tell):
        try:
            for k in range(3):
                done.append(k)
                tell(1)
        finally:
            tell(0, "stored")

    with pytest.raises(InterruptedError, match="another run failed or was interrupted"):
        perform(Job(work, 3), lambda *message: sent.append(message))
    assert done == [0, 1]
    assert sent[-1] == (1, "stored")

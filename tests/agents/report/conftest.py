"""Runs that a report shows, most of them made up, and the page made of them."""

import numpy as np
import pytest

from agents.evaluation.metrics import metrics
from agents.evaluation.players import Entry
from agents.paper.cases import measure, settings_of
from agents.report.command import RESULTS
from agents.report.page import page
from agents.report.runs import Run, play
from tests.support.recordings import made_up, papers_target


def synthetic(elbows, start):
    """A made-up run whose numbers differ between joints, cases, starts and instants; the arm stands still."""
    settings = settings_of(elbows, "paper", control_frequency=100.0, start=start)
    time = np.linspace(0.0, 5.0, 501)
    target = papers_target(time)
    factor = (3.0 - elbows) * (2.0 if start == "paper" else 1.0)
    ramp = np.repeat((time**2)[:, None, None], 10, axis=2) * np.arange(1.0, 11.0) * factor
    pose = np.broadcast_to(settings.parsed_arm.nominal_pose, (501, 1, 10))
    return made_up(
        settings,
        time,
        q=pose,
        hand=target - np.array([0.0, 0.001, 0.01 * (1 + factor)]) * (1.0 + 0.2 * np.sin(time))[:, None, None],
        target=target,
        electrical_energy=ramp,
        drawn_energy=ramp,
        link_work=0.01 * ramp,
        elbow_force=(time - 1.0)[:, None, None] * np.arange(1.0, 1.0 + elbows),
    )


def invented(controller, elbows, start):
    recording = synthetic(elbows, start)
    regimes = {"paper": {"A": 0.0, "B": 2.0}, "on_target": {"C": 0.0}}[start]
    figures = {
        name: {key: float(value[0]) for key, value in metrics(recording, since).items()}
        for name, since in regimes.items()
    }
    return Run(controller, str(elbows), start, recording, figures, measure(recording))


@pytest.fixture(scope="package")
def runs():
    """The paper's cases, made up, and PPO's two runs as they are."""
    paper = [invented("pd_paper", elbows, start) for elbows in (2, 1, 0) for start in ("paper", "on_target")]
    clipped = [invented("pd", elbows, "paper") for elbows in (2, 1, 0)]
    told = []
    entry = Entry("ppo", 2)
    learned = play(entry, told.append)
    assert sum(told) == 2 * entry.player().work
    return [*paper, *clipped, *learned]


@pytest.fixture(scope="package")
def document(runs):
    return page(runs, RESULTS)

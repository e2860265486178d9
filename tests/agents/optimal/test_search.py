"""`bound` on a short episode: from scratch, from the store, from a task nearby, and what it says when a check fails."""

import numpy as np
import pytest

from agents import optimal
from agents.control.trajectory import OpenLoop
from agents.optimal import certificate, search
from agents.optimal.guesses import rollout
from agents.optimal.solution import SolveError
from agents.optimal.store import Store
from elbow_gym.task.settings import Settings

SHORT = {"start": "on_target", "duration": 0.2, "start_noise": 0.0}


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """The store with one task, its settings, its bound, the lines of the solve, and what its checks were given."""
    pytest.importorskip("casadi")
    store, settings, said, given = Store(tmp_path_factory.mktemp("store")), Settings(**SHORT), [], []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "checked", lambda *what: given.append(what) or certificate.checked(*what))
        found = optimal.bound(settings, store=store, progress=said.append)
    return store, settings, found, said, *given


@pytest.mark.slow
def test_bound_is_what_the_simulator_makes_of_the_plan(solved):
    _, settings, found, *_ = solved
    cost, _ = rollout(settings, lambda env: OpenLoop(env, found.optimum.trajectory))
    assert cost == pytest.approx(found.cost, rel=1e-9)
    assert found.certificate.stationarity < 1e-6
    assert found.certificate.mesh_change < 0.005
    assert found.certificate.replay_error < 0.02


@pytest.mark.slow
def test_a_solved_task_is_taken_from_the_store(solved):
    store, settings, found, *_ = solved
    said = []
    again = optimal.bound(settings, store=store, progress=said.append)
    assert not said
    assert again.figures == found.figures
    np.testing.assert_array_equal(again.optimum.trajectory.voltage, found.optimum.trajectory.voltage)


@pytest.mark.slow
def test_a_task_nearby_is_solved_from_there_to_the_same_bound(solved):
    store, _, _, scratch, _ = solved
    settings, said = Settings(**SHORT, payload=0.1, circle={"radius": 0.09}), []
    near = optimal.bound(settings, store=store, progress=said.append)
    assert near.optimum.guess == "neighbour"
    assert len(said) < len(scratch)
    alone = optimal.bound(settings, store=store, fresh=True)
    assert alone.cost == pytest.approx(near.cost, rel=1e-3)
    # Of two solutions the cheaper one stays.
    assert alone.cost <= near.cost
    assert optimal.bound(settings, store=store).cost == min(near.cost, alone.cost)


@pytest.mark.slow
def test_a_task_with_other_elbows_is_no_neighbour(solved):
    from agents.optimal.problem import Problem

    store, settings, *_ = solved
    assert store.nearest(Problem(settings)).distance == 0.0
    assert store.nearest(Problem(Settings(**SHORT, elbows=1))) is None
    assert store.nearest(Problem(Settings(**SHORT, payload=30.0))) is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("REPLAY", "the simulator must reach the cost"),
        ("REFINEMENT", "refining must change the cost by at most"),
        ("STATIONARITY", "the Lagrangian's gradient must be at most"),
    ],
)
def test_a_check_that_fails_is_named_and_nothing_is_stored(solved, tmp_path, monkeypatch, name, said):
    # Of the solution that there is; to find it again for each check takes seconds.
    monkeypatch.setattr(search, "posture_guesses", lambda _: {})
    monkeypatch.setattr(search, "certified", lambda *_, **__: (certificate.checked(*solved[-1]), None))
    monkeypatch.setattr(certificate, name, 0.0)
    with pytest.raises(SolveError, match=said):
        optimal.bound(solved[1], store=Store(tmp_path))
    assert not list(tmp_path.iterdir())

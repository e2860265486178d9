"""`bound` on a short episode: from scratch, from the store, from a task nearby, and what it says when a check fails."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from agents import optimal
from agents.control.posture import best_postures
from agents.control.trajectory import OpenLoop
from agents.optimal import certificate, guesses, search
from agents.optimal.descent import Descent
from agents.optimal.guesses import posture_guesses, rollout
from agents.optimal.problem import Problem
from agents.optimal.solution import SolveError
from agents.optimal.store import Store
from elbow_gym import paper_arm
from elbow_gym.kinematics import elbow_heights, hand_position
from elbow_gym.task.circle import Circle
from elbow_gym.task.settings import Settings

SHORT = {"start": "on_target", "duration": 0.2, "start_noise": 0.0}


@pytest.fixture(scope="module", autouse=True)
def few_searches():
    """Two searches for a posture, where a dozen leave a better one: each takes a tenth of a second."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(guesses, "SEARCHES", 2)
        yield


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
    settings, said = Settings(**SHORT, payload=0.03, circle={"radius": 0.095}), []
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
    store, settings, *_ = solved
    assert store.nearest(Problem(settings)).distance == 0.0
    assert store.nearest(Problem(Settings(**SHORT, elbows=1))) is None
    assert store.nearest(Problem(Settings(**SHORT, payload=30.0))) is None


@pytest.mark.slow
def test_a_descent_ends_near_the_optimum_with_a_motion_of_the_simulator(solved):
    _, settings, found, *_ = solved
    guess = posture_guesses(Problem(settings))["paper posture"]
    trajectory = Descent(Problem(settings))(guess).trajectory
    cost, recording = rollout(settings, lambda env: OpenLoop(env, trajectory))
    np.testing.assert_allclose(recording.q[:, 0], trajectory.q, rtol=0.0, atol=1e-6)
    assert found.cost < cost < 1.25 * found.cost
    assert np.abs(trajectory.voltage).max() <= 24.0


@pytest.mark.slow
def test_a_descent_lifts_joints_above_the_table_and_keeps_to_a_weak_supply():
    settings = Settings(elbows=0, duration=0.4, voltage_limit=15.0, start_noise=0.0)
    guess = posture_guesses(Problem(settings))["paper posture"]
    under, above = (Descent(Problem(settings, above_table=above))(guess) for above in (False, True))
    lowest = [elbow_heights(settings.parsed_arm, end.trajectory.q, range(3, 12)).min() for end in (under, above)]
    assert lowest[0] < -0.02
    assert lowest[1] > -0.01
    assert above.depth == pytest.approx(-lowest[1])
    assert np.abs(above.trajectory.voltage).max() == 15.0


@pytest.mark.slow
def test_more_starts_are_different_motions_from_the_same_start(monkeypatch):
    problem = Problem(Settings(elbows=1, duration=0.1), above_table=True)
    postures = best_postures(paper_arm(), (4,), Circle())
    monkeypatch.setattr(guesses, "best_postures", lambda *_, **__: postures)
    found = posture_guesses(problem, 6)
    assert len(found) == 6
    assert list(posture_guesses(problem, 2)) == list(found)[:2]
    ends = np.array([guess.q[-1] for guess in found.values()])
    apart = np.abs(ends[:, None] - ends).max(axis=-1)[~np.eye(6, dtype=bool)]
    assert apart.min() > 1e-3
    np.testing.assert_allclose([guess.q[0] for guess in found.values()], np.tile(problem.start, (6, 1)))


def test_a_guess_goes_on_where_the_last_links_come_to_half_a_turn_from_the_start(monkeypatch):
    monkeypatch.setattr(guesses, "best_postures", lambda *_, **__: [])
    nominal = np.array(paper_arm().nominal_pose)
    path = posture_guesses(Problem(Settings(elbows=0), above_table=True))["paper posture"].q[:, -2]
    # The path's mean is half a turn away, so that it crosses the place where the nearest angle has another turn.
    nominal[-2] = path[100:].mean() - np.pi
    settings = Settings(elbows=0, arm=replace(paper_arm(), nominal_pose=tuple(nominal)))
    guess = posture_guesses(Problem(settings))["paper posture"]
    assert np.abs(np.diff(guess.q, axis=0)).max() < 0.3
    end = Problem(settings).target[-1]
    np.testing.assert_allclose(hand_position(settings.parsed_arm, guess.q[-1]), end, atol=1e-9)


def test_of_many_starts_each_is_followed_and_the_cheapest_solution_taken(monkeypatch):
    costs = {"dear": 3.0, "cheap": 1.0, "astray": np.nan, "fair": 2.0}

    def follow(_problem, guess, _progress):
        if np.isnan(costs[guess]):
            raise SolveError("astray")
        return SimpleNamespace(cost=costs[guess])

    monkeypatch.setattr(search, "Transcription", lambda *_: None)
    monkeypatch.setattr(search, "_follow", follow)
    monkeypatch.setattr(search, "_finished", lambda _program, coarse, name, *_: (name, coarse.cost))
    said = []
    found, _ = search.certified(None, {name: name for name in costs}, said.append, thorough=True)
    assert found == ("cheap", 1.0)
    assert said == ["astray: astray"]
    with pytest.raises(SolveError, match=r"a guess must lead to a solution, got none of \['astray'\]"):
        search.certified(None, {"astray": "astray"}, thorough=True)


def test_shipped_optima_are_solved_tasks_to_start_from(tmp_path):
    near = Store(tmp_path).nearest(Problem(Settings(payload=0.15)))
    assert (near.name, near.point) == ("elbows2", None)
    assert near.distance == pytest.approx(1.0)
    assert near.trajectory.q.shape == (251, 10)


@pytest.mark.slow
def test_many_tasks_are_solved_or_their_failures_named_and_the_store_is_asked_first(solved):
    store, settings, found, *_ = solved
    # Nothing can reach a circle that far in a fifth of a second, from where the start pose does not exist.
    far = Settings(**{**SHORT, "circle": {"center": [1.5, 1.5, 0.9]}})
    done = []
    first, second = optimal.bounds([settings, far], store=store, workers=1, progress=lambda *one: done.append(one))
    assert first.figures == found.figures
    assert second.startswith("position must be within reach of the last two links")
    assert dict(done) == {0: first, 1: second}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("REPLAY", "the simulator must reach the cost"),
        ("REFINEMENT", "refining must change the cost by at most"),
        ("STATIONARITY", "the Lagrangian's gradient must be at most"),
        ("COMPLEMENTARITY", "a bound's multiplier times the distance from it must be at most"),
    ],
)
def test_a_check_that_fails_is_named_and_nothing_is_stored(solved, tmp_path, monkeypatch, name, said):
    # Of the solution that there is; to find it again for each check takes seconds.
    monkeypatch.setattr(search, "posture_guesses", lambda *_: {})
    monkeypatch.setattr(search, "certified", lambda *_, **__: (certificate.checked(*solved[-1]), None))
    monkeypatch.setattr(certificate, name, 0.0)
    with pytest.raises(SolveError, match=said):
        optimal.bound(solved[1], store=Store(tmp_path))
    assert not list(tmp_path.iterdir())

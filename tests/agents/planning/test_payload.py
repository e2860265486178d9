"""Estimate of the payload: what the motion says, and what the planners make of it."""

from dataclasses import replace

import numpy as np
import pytest

from agents.control.inverse_dynamics import InverseDynamics
from agents.evaluation.metrics import metrics
from agents.evaluation.recording import record
from agents.planning.payload import PayloadEstimate
from agents.planning.receding_horizon import RecedingHorizon
from agents.planning.sampling import Sampling
from elbow_gym import ElbowArmEnv, paper_arm
from elbow_gym.task.settings import Settings
from tests.support.rollouts import driven

FEW = {"horizon": 0.06, "samples": 16, "rounds": 1}


def estimated(env, periods=10):
    """Estimates of an arm's payload after each period under smooth voltages about those that hold its start."""
    env.reset(seed=0)
    arm, elbows, period = env.episodes.arm, env.unwrapped.settings.elbow_joints, env.episodes.settings.control_period
    inverse, simulator = InverseDynamics(arm, elbows), env.episodes.simulator
    estimate, found = PayloadEstimate(inverse, period), []
    hold = inverse.resistance * inverse.hold(simulator.q[0]).current

    def state():
        return {name: getattr(simulator, name)[0].copy() for name in ("q", "q_dot", "current")}

    for k in range(periods):
        before, voltage = state(), np.clip(hold + np.sin(0.3 * k + np.arange(10)), -24.0, 24.0)
        env.step((voltage / 24.0).astype(np.float32))
        found.append(estimate.update(before, voltage, state()))
    return np.array(found)


@pytest.mark.parametrize("elbows", [0, 1, 2])
@pytest.mark.parametrize("payload", [0.0, 0.2])
def test_payload_is_found_within_a_period_and_better_with_more(elbows, payload):
    found = estimated(ElbowArmEnv(elbows=elbows, payload=payload, start="on_target"))
    assert abs(found[0] - payload) < 0.005
    assert abs(found[-1] - payload) < 0.001


def test_estimate_stays_between_nothing_and_the_arms_own_mass():
    arm = paper_arm()
    inverse, rest = InverseDynamics(arm), np.zeros(10)
    state = {"q": np.array(arm.nominal_pose), "q_dot": rest, "current": rest}
    hold = {mass: inverse.loaded(mass).hold(state["q"]).current * inverse.resistance for mass in (-1.0, 0.3, 3.0)}
    for mass, expected in zip(hold, (0.0, 0.3, 1.0), strict=True):
        held = {**state, "current": hold[mass] / inverse.resistance}
        assert PayloadEstimate(inverse, 0.02).update(held, hold[mass], held) == pytest.approx(expected, rel=0.01)


def test_where_nothing_weighs_and_nothing_moves_there_is_no_payload():
    inverse, rest = InverseDynamics(replace(paper_arm(), gravity=0.0)), np.zeros(10)
    state = {"q": rest, "q_dot": rest, "current": rest}
    assert PayloadEstimate(inverse, 0.02).update(state, rest, state) == 0.0


def test_planner_knows_the_payload_from_its_second_decision_on():
    env = ElbowArmEnv(payload=0.2, start="on_target")
    without, with_it = Sampling(env, **FEW), Sampling(env, **FEW, estimate_payload=True)
    first, second = (driven(env, planner, 3, 0) for planner in (without, with_it))
    np.testing.assert_array_equal(first[0], second[0])
    assert np.abs(first[1:] - second[1:]).max() > 0.0
    observation = env.reset(seed=0)[0]
    assert without._views(observation[None])[0].inverse.payload == 0.0
    assert Sampling(env, **FEW, estimate_payload=True)._views(observation[None])[0].inverse.payload == 0.0
    planner = Sampling(env, **FEW, estimate_payload=True)
    observation = env.step(planner.predict(observation)[0])[0]
    assert planner._views(observation[None])[0].inverse.payload == pytest.approx(0.2, abs=0.03)


def test_branches_cost_what_the_environment_with_the_payload_charges():
    env = ElbowArmEnv(payload=0.3, start="on_target")
    observation, _ = env.reset(seed=0)
    planner = Sampling(env, **FEW)
    view = planner._views(observation[None])[0]
    view = view._replace(inverse=view.inverse.loaded(0.3))
    plan = np.random.default_rng(0).uniform(-5.0, 5.0, (planner.periods, 10))
    cost = planner._branches.costs(view, np.repeat(plan[None], 16, axis=0))[0]
    rewards = [env.step(planner.interface.action(voltage))[1] for voltage in plan]
    end, tail = env.episodes.simulator, replace(planner.tail, inverse=view.inverse)
    behind = tail.cost(end.q[0], end.q_dot[0], view.target[2], view.velocity[2], 1.0, 0.001)
    assert cost == pytest.approx(behind - sum(rewards), rel=1e-6)


def test_programs_motion_equations_are_those_with_the_payload():
    pytest.importorskip("casadi")
    env = ElbowArmEnv(start="on_target")
    planner = RecedingHorizon(env, horizon=0.04, estimate_payload=True)
    view, program = planner._views(env.reset(seed=0)[0][None])[0], planner._program
    program.begin(view.state, view.target, inverse=view.inverse.loaded(0.3))
    x = program.join(*np.random.default_rng(1).normal(size=(3, 2, 2, 10)), np.zeros((2, 10)))

    def left():
        conditions = np.array(program._derivatives["jac_g"](x, program._parameters(0.01))[0]).ravel()
        return np.abs(conditions[: 4 * program.points.conditions].reshape(4, -1)[:, :10]).max()

    assert left() < 1e-10
    program.begin(view.state, view.target, inverse=view.inverse)
    assert left() > 0.1


@pytest.mark.slow
def test_estimated_payload_pays():
    settings = Settings(payload=0.2, start="on_target", duration=0.4, start_noise=0.0)
    found = [
        metrics(record(settings, lambda env, known=known: Sampling(env, estimate_payload=known), [0]))["return"][0]
        for known in (False, True)
    ]
    assert found[1] > 0.6 * found[0]

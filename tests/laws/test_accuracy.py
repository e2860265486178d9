"""Accuracy of what an environment does by default: whole episodes against steps of a tenth of a millisecond and less.

Bounds are shares of return and energy. An episode counts where its runs at 0.1 and at 0.05 ms agree to 5e-3: some
motions of an arm that is driven at random multiply any difference by more than that.
"""

import numpy as np
import pytest

from elbow_gym import ElbowArmVectorEnv, load_policy
from elbow_gym.baselines.tasks import registered_arguments

ARMS = 16
TABLE = dict(registered_arguments("ElbowArmTable-v0"))
ROUGH = {"elbow_friction": 0.1, "table": True, "heat": True, "supply_resistance": 0.1, "payload": 0.1}


def uniform(rng, _):
    return rng.uniform(-1.0, 1.0, (ARMS, 10))


def gentle(rng, observation):
    return 0.1 * uniform(rng, observation)


def bang_bang(rng, observation):
    return np.sign(uniform(rng, observation))


def shipped(**cell):
    """The shipped policy, shown what it was trained on where switches add entries behind that."""
    policy = load_policy("ppo", **cell)
    return lambda _, observation: policy.predict(observation[:, : policy.card.layers[0]], deterministic=True)[0]


def play(arguments, act, substeps=None):
    """Return, electrical energy and copper loss of episodes, (B,) each, in the default steps or so many equal ones."""
    env = ElbowArmVectorEnv(ARMS, autoreset_mode="Disabled", **arguments)
    if substeps is not None:
        arguments = {**arguments, "timestep": env.settings.control_period / substeps}
        env = ElbowArmVectorEnv(ARMS, autoreset_mode="Disabled", **arguments)
    observation, _ = env.reset(seed=100)
    rng, total = np.random.default_rng(1), np.zeros(ARMS)
    for _ in range(env.settings.horizon):
        observation, reward, terminated, _, info = env.step(act(rng, observation).astype(np.float32))
        assert not terminated.any()
        total += reward
    return np.stack([total, info["electrical_energy"], env.episodes.simulator.copper_loss.sum(axis=1)])


CASES = {
    "policy, two elbows": ({"elbows": 2}, shipped(elbows=2), (1e-5, 1e-4), (1e-5, 1e-4)),
    "policy, one elbow": ({"elbows": 1}, shipped(elbows=1), (1e-5, 1e-4), (1e-5, 1e-4)),
    "policy, no elbow": ({"elbows": 0}, shipped(elbows=0), (1e-5, 1e-4), (1e-5, 1e-4)),
    "uniform, two elbows": ({"elbows": 2}, uniform, (2e-3, 2e-2), (1e-3, 1e-2)),
    "uniform, no elbow": ({"elbows": 0}, uniform, (2e-3, 2e-2), (1e-3, 1e-2)),
    "bang-bang, no elbow": ({"elbows": 0}, bang_bang, (5e-3, 3e-2), (1e-3, 5e-3)),
    "policy on the table": (TABLE, shipped(env="ElbowArmTable-v0"), (2e-3, 2e-2), (5e-3, 2e-2)),
    "gentle on the table": (TABLE, gentle, (2e-3, 2e-2), (2e-3, 2e-2)),
    "gentle on a table with friction": ({**TABLE, "table": {"friction": 0.3}}, gentle, (2e-3, 2e-2), (2e-3, 2e-2)),
    "uniform, supply of 0.1 ohm": ({"supply_resistance": 0.1}, uniform, (5e-3, 2e-2), (5e-3, 2e-2)),
    "uniform, supply of 0.3 ohm": ({"supply_resistance": 0.3}, uniform, (5e-3, 2e-2), (5e-3, 2e-2)),
    "uniform, warm windings": ({"heat": True}, uniform, (5e-3, 2e-2), (5e-3, 2e-2)),
    "uniform, rough gears": ({"gear_coulomb_friction": 0.005}, uniform, (5e-3, 2e-2), (5e-3, 2e-2)),
    "uniform, payload": ({"payload": 0.3}, uniform, (5e-3, 2e-2), (5e-3, 2e-2)),
    "policy, rough": (ROUGH, shipped(elbows=2), (5e-3, 2e-2), (5e-3, 2e-2)),
    "uniform, rough": (ROUGH, uniform, (5e-3, 2e-2), (5e-3, 2e-2)),
}
"""Arguments of the environment, actions, and the largest mean and single errors of return and of energy."""
SAMPLE = (
    "policy, two elbows",
    "bang-bang, no elbow",
    "gentle on a table with friction",
    "uniform, rough",
)
"""Cases that have what all have: elbows and none, voltages that jump, a table that rubs, every switch at once."""
HALVES = [pytest.param(name, 2.5, id=f"{name}, half an episode") for name in SAMPLE]
WHOLE = [pytest.param(name, 5.0, id=name, marks=pytest.mark.soak) for name in CASES]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "duration"), [*HALVES, *WHOLE])
def test_default_steps_agree_with_steps_of_a_twentieth_of_a_millisecond(name, duration):
    arguments, act, *bounds = CASES[name]
    arguments = {**arguments, "duration": duration}
    coarse, fine, default = (play(arguments, act, substeps) for substeps in (200, 400, None))
    agree = (np.abs(coarse / fine - 1.0)[:2] < 5e-3).all(axis=0)
    assert agree.sum() >= 8
    error = np.abs(default / fine - 1.0)[:, agree]
    # Copper loss is as right as electrical energy.
    for found, (mean, worst) in zip(error, [*bounds, bounds[1]], strict=True):
        assert found.mean() <= mean
        assert found.max() <= worst

"""Randomised arms: drawn within their ranges, the same in a batch as alone, and settable."""

import numpy as np
import pytest

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv, dynamics, paper_arm
from elbow_gym.simulation.options import Conditions
from elbow_gym.task.arm_batch import Population
from elbow_gym.task.randomization import FACTORS, Randomization
from tests.support.kernel_calls import accelerations, states

EVERYTHING = {
    **{name: [0.9, 1.1] for name in FACTORS},
    "supply_voltage": [0.8, 1.2],
    "payload": [0.0, 0.2],
    "sensor_noise": [0.0, 0.01],
    "action_delay": [0, 2],
}
SWITCHES = {"table": True, "elbow_friction": 0.1, "heat": True}
CIRCLE = {"radius": [0.05, 0.1], "period": [4.0, 6.0], "phase": "random", "plane": "random"}


def actions(arms, steps, seed=0):
    return np.random.default_rng(seed).uniform(-0.4, 0.4, (steps, arms, 10)).astype(np.float32)


def test_draws_stay_in_their_ranges_and_differ_from_arm_to_arm():
    _, info = ElbowArmVectorEnv(64, randomize=EVERYTHING, gear_coulomb_friction=0.01, **SWITCHES).reset(seed=0)
    drawn = info["parameters"]
    nominal = Population(paper_arm(), Conditions(), Randomization(), 1).nominal
    nominal["gear_coulomb_friction"] = np.full(10, 0.01)
    for name in FACTORS:
        ratio = drawn[name][:, 1:] / nominal[name][1:]
        assert 0.9 <= ratio.min() < 0.91
        assert 1.09 < ratio.max() <= 1.1
    for name, low, high in (("supply_voltage", 19.2, 28.8), ("payload", 0.0, 0.2), ("sensor_noise", 0.0, 0.01)):
        span = 0.1 * (high - low)
        assert low <= drawn[name].min() < low + span < high - span < drawn[name].max() <= high
    assert set(drawn["action_delay"]) == {0.0, 1.0, 2.0}
    assert (drawn["length"][:, 0] == 0.0).all()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_a_random_batch_equals_single_environments_bit_for_bit(mode):
    arguments = {"randomize": EVERYTHING, "circle": CIRCLE, "duration": 0.2, "table": True, "elbows": 2}
    batch = ElbowArmVectorEnv(3, autoreset_mode=mode, **arguments)
    singles = [ElbowArmEnv(**arguments) for _ in range(3)]
    observation, info = batch.reset(seed=5)
    alone = [env.reset(seed=5 + i) for i, env in enumerate(singles)]
    np.testing.assert_array_equal(observation, [seen for seen, _ in alone])
    np.testing.assert_array_equal(info["parameters"]["mass"], [i["parameters"]["mass"] for _, i in alone])
    over = False
    for action in actions(3, 25):
        if over and mode == "Disabled":
            batch.reset(options={"reset_mask": np.ones(3, dtype=bool)})
        together = batch.step(action)
        if over and mode == "NextStep":
            expected = [env.reset()[0] for env in singles]
            np.testing.assert_array_equal(together[0], expected)
            over = False
            continue
        if over and mode == "Disabled":
            for env in singles:
                env.reset()
        steps = [env.step(one) for env, one in zip(singles, action, strict=True)]
        over = steps[0][3]
        np.testing.assert_array_equal(together[1], [step[1] for step in steps])
        if over and mode == "SameStep":
            np.testing.assert_array_equal(together[0], [env.reset()[0] for env in singles])
            np.testing.assert_array_equal(list(together[4]["final_obs"]), [step[0] for step in steps])
            over = False
        else:
            np.testing.assert_array_equal(together[0], [step[0] for step in steps])


def test_a_saved_state_of_a_random_arm_goes_on_bit_for_bit():
    arguments = {"randomize": EVERYTHING, "circle": CIRCLE, **SWITCHES}
    env, other = ElbowArmEnv(**arguments), ElbowArmEnv(**arguments)
    env.reset(seed=3)
    played = actions(1, 20)[:, 0]
    for action in played[:7]:
        env.step(action)
    other.set_state(env.get_state())
    for action in played[7:]:
        np.testing.assert_array_equal(env.step(action)[0], other.step(action)[0])
    np.testing.assert_array_equal(env.reset()[0], other.reset()[0])


def test_the_kernel_simulates_the_arm_that_was_drawn():
    env = ElbowArmEnv(elbows=0, randomize={name: EVERYTHING[name] for name in FACTORS})
    _, info = env.reset(seed=2)
    drawn = info["parameters"]
    arm = paper_arm()
    links = tuple(
        type(link)(mass=m, length=length)
        for link, m, length in zip(arm.links, drawn["mass"], drawn["length"], strict=True)
    )
    motors = tuple(
        type(motor)(torque_constant=k, armature_resistance=r, gear_viscous_friction=d)
        for motor, k, r, d in zip(
            arm.motors,
            drawn["torque_constant"],
            drawn["armature_resistance"],
            drawn["gear_viscous_friction"],
            strict=True,
        )
    )
    friction = tuple(drawn["joint_viscous_friction"])
    built = type(arm)(links=links, motors=motors, joint_viscous_friction=friction, nominal_pose=arm.nominal_pose)
    rng = np.random.default_rng(0)
    q, q_dot, current, voltage = rng.normal(size=(4, 10))
    rows = env.episodes.simulator.parameters(np.array([0]))
    found = accelerations(1, states(q[None], q_dot[None], current[None]), rows, voltage[None], ())
    expected = dynamics.forward_dynamics(built, q, q_dot, current, voltage)
    np.testing.assert_allclose(found[0][0], expected.q_ddot, rtol=0.0, atol=1e-10 * np.abs(expected.q_ddot).max())


def test_given_parameters_are_taken_and_forgotten_at_the_next_reset():
    env = ElbowArmEnv()
    _, info = env.reset(seed=0, options={"parameters": {"payload": 0.3, "mass": 0.2}})
    assert info["parameters"]["payload"] == 0.3
    np.testing.assert_array_equal(info["parameters"]["mass"], 0.2)
    heavy = env.step(np.zeros(10, np.float32))[0]
    _, info = env.reset(seed=0)
    assert "parameters" not in info
    light = env.step(np.zeros(10, np.float32))[0]
    fresh = ElbowArmEnv()
    fresh.reset(seed=0)
    np.testing.assert_array_equal(light, fresh.step(np.zeros(10, np.float32))[0])
    assert (heavy != light).any()


def test_random_lengths_keep_the_elbows_on_the_table():
    env = ElbowArmVectorEnv(8, randomize={"length": [0.95, 1.2]})
    env.reset(seed=1)
    for action in actions(8, 30):
        env.step(action)
    simulator = env.episodes.simulator
    length = env.episodes.population.values["length"]
    heights = np.cumsum(length[:, 1:] * np.cos(np.cumsum(simulator.q[:, 1:], axis=1)), axis=1)
    assert np.abs(heights[:, [1, 4]]).max() < 1e-12
    assert np.ptp(length[:, 1:]) > 0.05


def test_delayed_voltages_arrive_that_many_periods_later():
    env = ElbowArmEnv(randomize={"action_delay": [0, 3]})
    env.reset(seed=0, options={"parameters": {"action_delay": 2}})
    sent = actions(1, 6)[:, 0]
    arrived = [env.step(action)[4]["voltage"] for action in sent]
    np.testing.assert_array_equal(arrived[:2], np.zeros((2, 10)))
    np.testing.assert_allclose(arrived[2:], 24.0 * sent[:4].astype(np.float64), rtol=1e-15)
    seen = env.decode(env.step(sent[0])[0])["pending_voltage"].reshape(3, 10)
    np.testing.assert_allclose(seen, 24.0 * sent[[0, 5, 4]], rtol=1e-6)


def test_an_action_is_a_fraction_of_the_arms_own_supply():
    env = ElbowArmEnv()
    env.reset(seed=0, options={"parameters": {"supply_voltage": 12.0}})
    np.testing.assert_array_equal(env.step(np.full(10, 2.0, np.float32))[4]["voltage"], 12.0)
    volts = ElbowArmEnv(action_unit="volt")
    volts.reset(seed=0, options={"parameters": {"supply_voltage": 12.0}})
    np.testing.assert_array_equal(volts.step(np.full(10, 20.0, np.float32))[4]["voltage"], 12.0)


def test_noise_has_its_standard_deviation_and_leaves_the_clock_alone():
    env = ElbowArmVectorEnv(512, start_noise=0.0, randomize={"sensor_noise": 0.01})
    observation, _ = env.reset(seed=0)
    clean, _ = ElbowArmEnv(start_noise=0.0).reset(seed=0)
    error = observation - clean
    assert (error[:, -2:] == 0.0).all()
    np.testing.assert_allclose(error[:, :-2].std(axis=0), 0.01, rtol=0.2)
    assert np.abs(error[:, :-2].mean(axis=0)).max() < 0.002


@pytest.mark.parametrize(
    ("randomize", "message"),
    [
        ({"colour": [0.0, 1.0]}, "randomize must have only the entries"),
        ({"mass": [0.0, 1.0]}, "randomize mass must be positive, got 0.0"),
        ({"mass": [1.2, 0.8]}, r"randomize mass must be a number or \[low, high\]"),
        ({"action_delay": [0, 1.5]}, "randomize action_delay must be a whole number of control periods, got 1.5"),
        ([1], r"randomize must be a dict of ranges or None, got \[1\]"),
    ],
)
def test_a_wrong_range_is_named(randomize, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        ElbowArmEnv(randomize=randomize)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"mass": -1.0}, r"options\['parameters'\]\['mass'\] must not be negative, got -1.0"),
        ({"mass": [1.0, 2.0]}, r"options\['parameters'\]\['mass'\] must be numbers of shape \(10,\)"),
        ({"torque_constant": 0.0}, r"options\['parameters'\]\['torque_constant'\] must be positive, got 0.0"),
        ({"action_delay": 1}, "action_delay must be at most 0, the upper end of randomize's range, got 1"),
        ({"length": 0.1}, "circle must lie within the hand's reach"),
        (3, r"options\['parameters'\] must be a dict of values, got 3"),
    ],
)
def test_wrong_parameters_are_an_error_that_changes_nothing(given, message):
    env, twin = ElbowArmEnv(), ElbowArmEnv()
    for one in (env, twin):
        one.reset(seed=0)
    with pytest.raises(ValueError, match=f"^{message}"):
        env.reset(options={"parameters": given})
    action = np.full(10, 0.1, np.float32)
    np.testing.assert_array_equal(env.step(action)[0], twin.step(action)[0])
    np.testing.assert_array_equal(env.reset(seed=4)[0], twin.reset(seed=4)[0])


def test_a_given_circle_stands_in_for_the_drawn_one():
    env = ElbowArmEnv(circle={"radius": [0.05, 0.15], "phase": "random"})
    _, info = env.reset(seed=0, options={"circle": {"radius": 0.1, "phase": 1.0}})
    assert (info["circle"]["radius"], info["circle"]["phase"]) == (0.1, 1.0)
    np.testing.assert_allclose(env.episodes.target()[0], [1.5 + 0.1 * np.cos(1.0), 1.5 + 0.1 * np.sin(1.0), 0.4])
    with pytest.raises(ValueError, match=r"^circle must lie within the hand's reach"):
        env.reset(options={"circle": {"center": [9.0, 0.0, 0.0]}})


def test_each_arm_follows_its_own_circle():
    env = ElbowArmVectorEnv(4, circle=CIRCLE)
    env.reset(seed=0)
    for action in actions(4, 5):
        _, _, _, _, info = env.step(action)
    circles, time = env.episodes.targets.circles, 5 * 0.02
    targets = [circle.position(circle.angle(time, circle.phase)) for circle in circles]
    np.testing.assert_allclose(env.episodes.target(), targets, atol=1e-12)
    error = np.linalg.norm(env.episodes.simulator.hand_position - targets, axis=1)
    np.testing.assert_allclose(info["tracking_error"], error, atol=1e-12)


POINTS = [[1.5, 1.4, 0.4], [1.6, 1.5, 0.4], [1.5, 1.6, 0.5], [1.4, 1.5, 0.4]]


@pytest.mark.parametrize("shape", ["figure_eight", POINTS])
def test_other_paths_are_followed_in_the_environment(shape):
    env = ElbowArmEnv(circle={"shape": shape, "period": 4.0})
    env.reset(seed=0)
    _, _, _, _, info = env.step(np.zeros(10, np.float32))
    circle = env.settings.parsed_circle
    target = circle.position(circle.angle(0.02, 0.0))
    hand = env.episodes.simulator.hand_position[0]
    assert info["tracking_error"] == pytest.approx(np.linalg.norm(hand - target), abs=1e-12)

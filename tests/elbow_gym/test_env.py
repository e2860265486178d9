"""The single environment: Gymnasium's rules, exact continuation, wrong input, and a reward that is error and power."""

import copy
import functools
import itertools
import json
import math
import pickle
import subprocess
import sys
from fractions import Fraction

import cloudpickle
import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env, data_equivalence

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv, paper_arm
from tests.support.arms import blow_up

ID = "elbow_gym:ElbowArm-v0"
POSE = np.array(paper_arm().nominal_pose)
ACTIONS = np.random.default_rng(11).uniform(-1.0, 1.0, (12, 10)).astype(np.float32)
SIX_JOINTS = {name: rows[:6] for name, rows in paper_arm().to_dict().items() if name != "gravity"}
SIX_JOINTS["links"][5] = {"length": 0.5, "mass": 0.3, "radius": 0.02}
NEAR = {"center": [0.9, 0.3, 0.3], "plane": "radial"}
OTHER_ARM = json.loads(json.dumps({"arm": SIX_JOINTS, "elbows": [4], "circle": NEAR}))
VOLT = pytest.mark.filterwarnings("ignore:.*symmetric and normalized")
# The hand 10 m off along each axis and 500 A through each of ten motors at 24 V.
WORST_RATE = math.sqrt(300.0) + 0.001 * 10 * 24.0 * 500.0
same = functools.partial(data_equivalence, exact=True)


def started(seed=3, steps=5, **settings):
    """An environment in the middle of an episode."""
    env = ElbowArmEnv(**settings)
    env.reset(seed=seed)
    run(env, ACTIONS[:steps])
    return env


def run(env, actions=ACTIONS):
    return [env.step(action) for action in actions]


def future(env):
    """What the environment does from here: a few steps and the next episode, which needs its generator."""
    return [*run(env), env.reset(), *run(env)]


@pytest.mark.parametrize(
    "settings",
    [
        *({"elbows": elbows} for elbows in (0, 1, 2, (3, 5))),
        pytest.param({"action_unit": "volt"}, marks=VOLT),
        {"start": "on_target"},
        {"circle": {"phase": "random"}},
        {"regeneration": False},
        {"control_frequency": 500.0, "duration": 0.1},
        OTHER_ARM,
    ],
    ids=str,
)
def test_checkers_of_gymnasium_and_stable_baselines_find_nothing(settings):
    env = gym.make(ID, **settings)
    check_env(env.unwrapped)
    pytest.importorskip("stable_baselines3.common.env_checker").check_env(env)


def test_spec_round_trips_through_json_to_an_equal_environment():
    env = gym.make(ID, **OTHER_ARM, control_frequency=100.0, regeneration=False)
    twin = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert type(env.unwrapped) is ElbowArmEnv
    assert same(env.reset(seed=5), twin.reset(seed=5))
    assert same(run(env, ACTIONS[:, :6]), run(twin, ACTIONS[:, :6]))


@pytest.mark.parametrize("library", [pickle, cloudpickle])
def test_spec_constructor_and_running_environment_travel_to_other_processes(library):
    make = functools.partial(gym.make, ID, elbows=1)
    there, spec = library.loads(library.dumps((make, make().spec)))
    assert spec == make().spec
    assert same(there().reset(seed=5), make().reset(seed=5))
    env = started(elbows=1)
    twins = [library.loads(library.dumps(env)), copy.deepcopy(env)]
    ahead = future(env)
    assert all(same(ahead, future(twin)) for twin in twins)


def test_continuing_from_a_saved_state_is_bit_identical_generator_included():
    env = started(circle={"phase": "random"})
    state = env.get_state()
    ahead = future(env)
    env.set_state(state)
    assert same(ahead, future(env))
    other = ElbowArmEnv(circle={"phase": "random"})
    other.set_state(state)
    assert same(ahead, future(other))


@pytest.mark.parametrize("unit", ["fraction", "volt"])
def test_action_out_of_range_acts_like_the_nearest_bound(unit):
    env, twin = started(action_unit=unit), started(action_unit=unit)
    high = env.action_space.high[0]
    assert high == {"fraction": 1.0, "volt": 24.0}[unit]
    wild = np.array([1.5, -7.0, np.inf, -np.inf, 1e30, -1e30, 0.5, -0.5, 1.0, -1.0], np.float32) * high
    assert same(env.step(wild), twin.step(np.clip(wild, -high, high)))
    assert env.step(wild)[4]["voltage"].tolist() == [24.0, -24.0, 24.0, -24.0, 24.0, -24.0, 12.0, -12.0, 24.0, -24.0]


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.full(10, np.nan), r"action must not be NaN, got \[nan, "),
        ([*[0.0] * 9, math.nan], r"action must not be NaN, got \[.*0.0, nan\]"),
        (np.zeros(9), r"action must have shape \(10,\), got \(9,\)"),
        (np.zeros((1, 10)), r"action must have shape \(10,\), got \(1, 10\)"),
        (0.5, r"action must have shape \(10,\), got \(\)"),
        (["up"] * 10, r"action must be numbers of shape \(10,\), got \['up'"),
    ],
)
def test_wrong_action_is_an_error_that_leaves_the_state_untouched(action, message):
    env, twin = started(), started()
    before = env.get_state()
    with pytest.raises(ValueError, match=f"^{message}"):
        env.step(action)
    assert same(env.get_state(), before)
    assert same(future(env), future(twin))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"pose": POSE},
            r"options must have only the entries \['state', 'phase', 'circle', .*\], got 'pose'",
        ),
        ({"state": POSE}, r"options\['state'\] must be a dict, got "),
        ({"state": {}}, r"options\['state'\] must have the entry 'q', got \[\]"),
        ({"state": {"q": POSE, "v": POSE}}, r"options\['state'\] must have only the entries .*, got 'v'"),
        ({"state": {"q": POSE[:9]}}, r"q must have shape .*, got \(9,\)"),
        ({"state": {"q": POSE, "q_dot": np.zeros((2, 10))}}, r"q_dot must have shape .*, got \(2, 10\)"),
        ({"state": {"q": POSE, "current": np.full(10, np.inf)}}, "current must be finite, got inf"),
        ({"state": {"q": np.full(10, np.nan)}}, "q must be finite, got nan"),
        ({"state": {"q": "upright"}}, "q must .*, got 'upright'"),
        ({"state": {"q": POSE + 0.1 * np.eye(10)[1]}}, "q must hold elbow joint 7 at z = 0 to 1e-08 m, got 0.11466"),
        ({"state": {"q": POSE, "q_dot": np.eye(10)[1]}}, "q_dot must keep the elbows at z = 0, got "),
        ({"phase": math.nan}, "phase must be finite, got nan"),
        ({"phase": "random"}, "phase must be an angle in rad, got 'random'"),
        ({"state": {"q": POSE}, "phase": [1.0]}, r"phase must be an angle in rad, got \[1.0\]"),
    ],
)
@pytest.mark.parametrize("seed", [None, 9])
def test_wrong_reset_option_is_an_error_that_leaves_everything_untouched(options, message, seed):
    env, twin = started(circle={"phase": "random"}), started(circle={"phase": "random"})
    before = env.get_state()
    with pytest.raises(ValueError, match=f"^{message}"):
        env.reset(seed=seed, options=options)
    assert same(env.get_state(), before)
    assert same(future(env), future(twin))


def test_pose_beyond_what_the_arm_can_represent_is_refused():
    env = ElbowArmEnv(elbows=0)
    with pytest.raises(ValueError, match=r"^q must .*, got "):
        env.reset(options={"state": {"q": np.full(10, 2e5)}})


def test_reset_options_set_state_and_phase_exactly():
    env = ElbowArmEnv(elbows=0)
    state = {"q": POSE + 0.25, "q_dot": np.linspace(-2.0, 2.0, 10), "current": np.linspace(1.0, 3.0, 10)}
    seen = env.decode(env.reset(options={"state": state, "phase": math.pi / 2})[0])
    np.testing.assert_allclose(seen["joint_angle"], 0.25, rtol=1e-6)
    np.testing.assert_allclose(seen["joint_velocity"], state["q_dot"], rtol=1e-6)
    np.testing.assert_allclose(seen["current"], state["current"], rtol=1e-6)
    np.testing.assert_allclose(seen["target_angle"], [0.0, 1.0], atol=1e-7)


@pytest.mark.parametrize(("duration", "frequency"), [(5.0, 50.0), (1.0, 30.0), (0.1, 1000.0), (0.02, 50.0)])
def test_truncated_after_the_duration_and_never_before(duration, frequency):
    env = ElbowArmEnv(duration=duration, control_frequency=frequency)
    env.reset(seed=0)
    steps = next(count for count in itertools.count(1) if env.step(ACTIONS[0])[3])
    assert steps / frequency == pytest.approx(duration, rel=1e-12)


@pytest.mark.parametrize("lived", [0, 100, 249])
def test_leaving_float64_terminates_and_costs_the_worst_rate_for_all_the_remaining_time(lived):
    env = started(steps=0)
    run(env, np.zeros((lived, 10)))
    blow_up(env)
    observation, reward, terminated, truncated, info = env.step(ACTIONS[0])
    assert (terminated, truncated) == (True, False)
    assert observation in env.observation_space
    assert reward == pytest.approx(-WORST_RATE * (250 - lived), rel=1e-6)
    assert reward == info["reward_tracking"] + info["reward_energy"]


@pytest.mark.parametrize("elbows", [0, 1, 2])
@pytest.mark.parametrize("drive", ["random", "bang-bang", "pumping"])
def test_any_play_stays_in_the_observation_space_and_costs_less_than_the_worst_rate(elbows, drive):
    env, rng = ElbowArmEnv(elbows=elbows, duration=10.0), np.random.default_rng(4)
    observation, _ = env.reset(seed=2)
    for _ in range(env.settings.horizon):
        q_dot = env.decode(observation)["joint_velocity"]
        action = rng.uniform(-1.0, 1.0, 10) if drive != "pumping" else np.where(q_dot >= 0.0, 1.0, -1.0)
        observation, reward, terminated, _, _ = env.step(np.sign(action) if drive == "bang-bang" else action)
        assert observation in env.observation_space
        assert not terminated
        assert reward > -WORST_RATE


@pytest.mark.parametrize("regeneration", [True, False])
def test_reward_is_error_and_power_and_power_adds_up_to_the_energy(regeneration):
    env = ElbowArmEnv(regeneration=regeneration, control_frequency=20.0)
    observation, info = env.reset(seed=6)
    spent, drawn = 0.0, 0.0
    for action in 3.0 * ACTIONS:
        observation, reward, _, _, info = env.step(action)
        spent += info["electrical_power"] / 20.0
        # Rounded once.
        assert reward == float(Fraction(info["reward_tracking"]) - Fraction(info["electrical_power"]) * Fraction(0.001))
        assert reward == pytest.approx(info["reward_tracking"] + info["reward_energy"], rel=1e-15)
        assert reward == pytest.approx(-(info["tracking_error"] + 0.001 * info["electrical_power"]), rel=1e-12)
        assert info["tracking_error"] == pytest.approx(np.linalg.norm(env.decode(observation)["hand_error"]), rel=1e-6)
        assert info["drawn_energy"] >= max(drawn, info["electrical_energy"])
        drawn = info["drawn_energy"]
    assert info["electrical_energy"] < drawn
    assert spent == pytest.approx(info["electrical_energy"] if regeneration else drawn, rel=1e-12)


def test_weights_can_be_set_from_the_next_step_on():
    env = started()
    env.set_energy_weight(0.5)
    env.set_tracking_weight(0.0)
    _, reward, _, _, info = env.step(ACTIONS[0])
    assert reward == pytest.approx(-0.5 * info["electrical_power"], rel=1e-12)
    for name in ("energy_weight", "tracking_weight"):
        with pytest.raises(ValueError, match=f"^{name} must not be negative, got -1.0$"):
            getattr(env, f"set_{name}")(-1.0)


def test_step_before_reset_needs_a_reset():
    with pytest.raises(gym.error.ResetNeeded, match=r"^reset must be called before step$"):
        ElbowArmEnv().step(ACTIONS[0])


def test_numbers_of_infos_are_numpys_floats_and_pythons_too():
    env = started()
    for info in (env.reset()[1], env.step(ACTIONS[0])[4]):
        numbers = {name: value for name, value in info.items() if np.ndim(value) == 0}
        assert len(numbers) == 9
        assert all(type(value) is np.float64 and isinstance(value, float) for value in numbers.values())


@pytest.mark.slow
def test_gymnasiums_checker_passes_without_pygame():
    code = (
        "import sys; sys.modules['pygame'] = None\n"
        "import warnings; warnings.simplefilter('error')\n"
        "import gymnasium as gym, elbow_gym\n"
        "from gymnasium.utils.env_checker import check_env\n"
        "env = gym.make('ElbowArm-v0')\n"
        "check_env(env.unwrapped)\n"
        "assert env.metadata['render_modes'] == []\n"
        "env = elbow_gym.ElbowArmEnv(render_mode='rgb_array'); env.reset()\n"
        "try: env.render()\n"
        "except gym.error.DependencyNotInstalled as error: print(error)\n"
    )
    said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert said == 'pygame-ce is not installed, run `pip install "elbow-gym[render]"`\n'


def test_unknown_render_mode_is_a_value_error():
    with pytest.raises(ValueError, match=r"^render_mode must be .*, got 'hologram'$"):
        ElbowArmEnv(render_mode="hologram")


HUGE = 10**400
RANDOM_ARM = {"randomize": {"mass": [0.8, 1.2], "length": [0.95, 1.05]}, "circle": {"radius": [0.05, 0.1]}}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["phase"], r"options must be a dict, got \['phase'\]"),
        (3, "options must be a dict, got 3"),
        ({1: 2, "pose": 3}, r"options must have only the entries .*, got 1"),
        ({"phase": "random"}, "phase must be an angle in rad, got 'random'"),
        ({"phase": HUGE}, "phase must be finite, got an integer of more than twenty digits"),
        ({"phase": np.array(1.0)}, r"phase must be an angle in rad, got array\(1\.\)"),
        ({"state": {"q": [HUGE] * 10}}, "q must be numbers of shape "),
        ({"parameters": {"payload": HUGE}}, r"options\['parameters'\]\['payload'\] must be "),
        ({"circle": {"radius": np.array(0.1)}}, r"circle radius must be a number, got array\(0.1\)"),
        ({"circle": {"center": np.array(0.1)}}, "circle center must have three coordinates, got 0.1"),
        ({"circle": {"center": [HUGE, 1.0, 0.5]}}, "circle center must be finite, got "),
        ({"circle": {"shape": np.array(2.0)}}, "circle shape must be one of .* or a list of points, got 2.0"),
        ({"circle": {"shape": [[0.0, 0.0, HUGE]] * 3}}, "circle shape must have points of three finite numbers, got "),
        ({"circle": {"direction": ["up"]}}, r"circle direction must be one of .*, got \['up'\]"),
        ({"circle": {"period": 1e-300}}, r"circle period must be at least one control period \(0.02 s\), got 1e-300"),
    ],
)
@pytest.mark.parametrize("seed", [None, 9])
def test_a_refused_reset_has_drawn_nothing(options, message, seed):
    env, twin = started(**RANDOM_ARM), started(**RANDOM_ARM)
    with pytest.raises(ValueError, match=f"^{message}"):
        env.reset(seed=seed, options=options)
    assert same(env.get_state(), twin.get_state())
    assert same(future(env), future(twin))


def test_an_interrupted_reset_has_drawn_nothing(monkeypatch):
    env, twin = started(**RANDOM_ARM), started(**RANDOM_ARM)

    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(env.episodes.simulator, "on_table", interrupt)
    with pytest.raises(KeyboardInterrupt):
        env.reset(seed=9)
    monkeypatch.undo()
    assert same(future(env), future(twin))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"circle": {"period": 1e-300}}, r"circle period must be at least one control period \(0.02 s\), got 1e-300"),
        (
            {"circle": {"period": [0.01, 2.0]}},
            r"circle period must be at least one control period \(0.02 s\), got 0.01",
        ),
        (
            {"circle": {"center": [1.5, 1.5, 0.05], "plane": "xz"}, "table": True, "elbows": 0},
            "circle must not go below the table, which pushes, got 0.05 m below z = 0",
        ),
        (
            {"circle": {"center": [1.5, 1.5, [-0.1, 0.4]]}, "table": True},
            "circle must not go below the table, which pushes, got 0.1 m below z = 0",
        ),
        (
            {"arm": paper_arm().to_dict() | {"nominal_pose": [1e308] * 10}},
            "nominal_pose must be within 100000 rad, got ",
        ),
        ({"duration": 1e9}, "duration must be a countable number of control periods, got 1000000000.0"),
        ({"duration": HUGE}, "duration must be finite, got an integer of more than twenty digits"),
        ({"action_unit": ["volt"]}, r"action_unit must be one of .*, got \['volt'\]"),
        ({"start": np.array(["paper", "paper"])}, "start must be one of "),
        ({"elbows": np.array(2.0)}, "elbows must be 0, 1, 2 or a tuple of joint numbers, got "),
    ],
)
def test_wrong_arguments_are_refused_by_name(arguments, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        ElbowArmEnv(**arguments)
    with pytest.raises(ValueError, match=f"^{message}"):
        ElbowArmVectorEnv(2, **arguments)

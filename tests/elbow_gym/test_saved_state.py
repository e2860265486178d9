"""States saved and restored: what a state must be, one arm's in places of a batch, states that arrive read-only."""

import copy
import functools
import pickle
from dataclasses import replace

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv, Simulator, paper_arm
from elbow_gym.kernel.build import kernel
from elbow_gym.task.saved_state import check_basis
from elbow_gym.task.settings import Settings

RANDOM = {
    "randomize": {"mass": [0.8, 1.2], "sensor_noise": [0.01, 0.02], "action_delay": [0, 2], "length": [0.95, 1.05]},
    "circle": {"radius": [0.05, 0.1], "phase": "random"},
    "duration": 0.2,
}
ACTIONS = np.random.default_rng(2).uniform(-1.0, 1.0, (14, 5, 10)).astype(np.float32)
same = functools.partial(data_equivalence, exact=True)


def played(env, steps=3):
    env.reset(seed=4)
    for action in ACTIONS[:steps]:
        env.step(action if isinstance(env, ElbowArmVectorEnv) else action[0])
    return env


def steps_of(env, arm=None, action=0):
    """What an environment, or one arm of a batch, shows from here on until its next episode."""
    shown = []
    for actions in ACTIONS:
        observation, reward, terminated, truncated, info = env.step(
            actions[action] if arm is None else np.tile(actions[action], (env.num_envs, 1))
        )
        over = terminated or truncated if arm is None else terminated[arm] or truncated[arm]
        rows = (observation, reward, info["electrical_energy"], info["voltage"])
        shown.append([np.array(row if arm is None else row[arm]) for row in rows])
        if over:
            break
    return shown


def put_entry(state, path, value):
    """A copy of a state with another entry, or without it where the value is None."""
    state = copy.deepcopy(state)
    *folders, last = path
    place = functools.reduce(lambda part, name: part[name], folders, state)
    if value is None:
        del place[last]
    else:
        place[last] = value(place[last]) if callable(value) else value
    return state


def with_entry(index, entry):
    """A function that gives a copy of an array with one entry replaced."""

    def change(array):
        array = np.array(array)
        array[index] = entry
        return array

    return change


SIMULATOR = ("episodes", "simulator")
WRONG = [
    ((), lambda _: 3, "state must be a dict, got 3"),
    (("episodes",), None, "state must have the entry 'episodes', got "),
    (("episodes",), [], r"state\['episodes'\] must be a dict, got \[\]"),
    (("episodes", "queue"), None, r"state\['episodes'\] must have the entry 'queue'"),
    (("episodes", "queue"), with_entry((0, 0, 0), np.inf), r"state\['queue'\] must be finite, got inf"),
    (("episodes", "steps"), lambda steps: steps - 90, r"state\['steps'\] must be from 0 to 2147483648, got -8"),
    (("episodes", "steps"), lambda steps: steps + 0.5, r"state\['steps'\] must have entries as int64, got float64"),
    (("episodes", "noise"), lambda noise: noise[:, 1:], r"state\['noise'\] must have shape \(1, 39\), got \(1, 38\)"),
    ((*SIMULATOR, "state"), with_entry((0, 1, 3), np.nan), r"state\['state'\] must be finite, got nan"),
    ((*SIMULATOR, "state"), with_entry((0, 0, 3), 2e5), "q must be within 100000 rad, got 200000"),
    ((*SIMULATOR, "state"), with_entry((0, 0, 2), 1.0), "q must hold elbow joint . at z = 0 to .* m, got 0.67"),
    ((*SIMULATOR, "state"), with_entry((0, 1, 2), 1.0), "q_dot must keep the elbows at z = 0, got "),
    ((*SIMULATOR, "state"), with_entry((0, 5, 2), -1.0), r"state\['state'\] must have no negative losses, got -1 J"),
    ((*SIMULATOR, "state"), "rest", r"state\['state'\] must have shape .*, got \(\)"),
    ((*SIMULATOR, "summary"), lambda summary: summary + 0.5, r"state\['summary'\] must be of `get_state`"),
    ((*SIMULATOR, "clock"), None, "state must have the entry 'clock', got "),
    ((*SIMULATOR, "clock"), lambda clock: clock - 9, r"state\['clock'\] must not be negative, got -9"),
    (("episodes", "parameters", "mass"), None, r"state\['parameters'\] must have the entry 'mass'"),
    (("episodes", "parameters", "mass"), with_entry((0, 2), 0.0), r"state\['parameters'\]\['mass'\] must be positive"),
    (("episodes", "parameters", "action_delay"), np.array([3.0]), "action_delay must be at most 2"),
    (
        ("episodes", "parameters", "torque_constant"),
        lambda constant: 1e4 * constant,
        r"options\['parameters'\] must allow substeps of ",
    ),
    (("episodes", "targets", "circles"), [None], r"state\['targets'\]\['circles'\] must be a list of drawn circles"),
    (("episodes", "targets", "circles"), lambda circles: 2 * circles, r"state\['targets'\]\['circles'\] must have 1 "),
    (("generators",), [], r"state\['generators'\] must be a list with an entry for each arm, got \[\]"),
    (("generators",), [{"bit_generator": "PCG64"}], r"state\['generators'\] must have states of PCG64, got "),
    (("over",), np.zeros(1), r"state\['over'\] must have entries as bool, got float64"),
]


@pytest.mark.parametrize(("path", "value", "message"), WRONG)
def test_a_wrong_state_is_refused_by_name_before_anything_changes(path, value, message):
    env, twin = played(ElbowArmEnv(**RANDOM)), played(ElbowArmEnv(**RANDOM))
    before = env.get_state()
    wrong = put_entry(env.get_state(), path, value) if path else value(None)
    with pytest.raises(ValueError, match=f"^{message}"):
        env.set_state(wrong)
    assert same(env.get_state(), before)
    assert same(steps_of(env), steps_of(twin))
    assert same(env.reset(), twin.reset())


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"elbows": 1}, r"the same elbows, \(4, 7\), got \(4,\)"),
        ({"elbows": (4, 6)}, r"the same elbows, \(4, 7\), got \(4, 6\)"),
        ({"integrator": "rk4"}, "the same integrator, 'exponential', got 'rk4'"),
        ({"control_frequency": 100.0}, "the same control_frequency, 50.0, got 100.0"),
        ({"payload": 0.1}, "the same payload, 0.0, got 0.1"),
        ({"arm": replace(paper_arm(), gravity=9.0)}, "the same arm, "),
    ],
)
def test_a_state_of_other_settings_is_refused(other, message):
    env = played(ElbowArmEnv())
    with pytest.raises(ValueError, match=f"^state must be of an environment with {message}"):
        env.set_state(ElbowArmEnv(**other).get_state())


def test_classical_steps_are_not_given_windings_of_a_longer_episode():
    warm = Settings(heat=True, integrator="rk4").basis
    check_basis(warm, {**warm})
    with pytest.raises(ValueError, match=r"^state must be of an environment with the same duration, 5.0, got 500.0$"):
        check_basis(warm, Settings(heat=True, integrator="rk4", duration=500.0).basis)


def test_prices_starts_and_durations_may_differ():
    env, other = played(ElbowArmEnv()), ElbowArmEnv(energy_weight=0.5, duration=1.0, start="on_target", start_noise=0.0)
    other.set_state(env.get_state())
    assert env.step(ACTIONS[0, 0])[4]["tracking_error"] == other.step(ACTIONS[0, 0])[4]["tracking_error"]


@pytest.mark.parametrize("arms", [[3, 1], np.array([0]), np.array([False, True, True, False, True]), range(5)])
def test_the_state_of_one_arm_goes_on_in_any_arms_of_a_batch(arms):
    env, batch, twin = ElbowArmEnv(**RANDOM), ElbowArmVectorEnv(5, **RANDOM), ElbowArmVectorEnv(5, **RANDOM)
    played(env), played(batch, 5), played(twin, 5)
    batch.set_state(env.get_state(), arms=arms)
    chosen = np.flatnonzero(arms) if np.asarray(arms).dtype == bool else list(arms)
    state, untouched, expected = batch.get_state(), twin.get_state(), steps_of(env)
    for arm in range(5):
        batch.set_state(state)
        twin.set_state(untouched)
        assert same(steps_of(batch, arm), expected if arm in chosen else steps_of(twin, arm))


def test_an_arm_of_a_batch_goes_on_alone_and_some_go_on_in_another_batch():
    batch = played(ElbowArmVectorEnv(5, **RANDOM))
    env, other = ElbowArmEnv(**RANDOM), played(ElbowArmVectorEnv(7, **RANDOM), 0)
    env.set_state(batch.get_state(arms=[2]))
    other.set_state(batch.get_state(arms=[4, 2]), arms=[0, 6])
    expected = steps_of(batch, 2)
    assert same(steps_of(env), expected)
    assert same(steps_of(other, 6), expected)


@pytest.mark.parametrize(
    ("arms", "message"),
    [
        ([5], r"arms must be a mask, or numbers from 0 to 4, each once, got \[5\]"),
        ([-1], "arms must be a mask"),
        ([1, 1], "arms must be a mask"),
        ([0.0], "arms must be a mask"),
        ([], "arms must be a mask"),
        (np.zeros(5, dtype=bool), "arms must be a mask"),
        ([1, 2, 3], "state must be of 3 arms, got one of 2"),
        (None, "state must be of 5 arms, got one of 2"),
    ],
)
def test_wrong_arms_are_refused(arms, message):
    batch = played(ElbowArmVectorEnv(5, duration=0.2))
    state = batch.get_state(arms=[0, 1])
    with pytest.raises(ValueError, match=f"^{message}"):
        batch.set_state(state, arms=arms)


def test_a_state_of_one_arm_needs_to_be_told_its_arms():
    batch, env = played(ElbowArmVectorEnv(5)), played(ElbowArmEnv())
    with pytest.raises(ValueError, match=r"^state must be of 5 arms, got one of 1"):
        batch.set_state(env.get_state())
    with pytest.raises(ValueError, match=r"^state must be of one arm, got one of 5"):
        env.set_state(batch.get_state())


def test_a_simulators_state_is_checked_before_it_is_written():
    simulator = Simulator(num_envs=3)
    simulator.step(np.ones(10))
    before = simulator.get_state()
    for name, index, entry in [("state", (1, 0, 4), np.nan), ("state", (1, 0, 2), 1.0), ("clock", (2, 1), -1)]:
        with pytest.raises(ValueError, match="must "):
            simulator.set_state({**before, name: with_entry(index, entry)(before[name])})
        assert same(simulator.get_state(), before)


def arrived(thing):
    """A thing sent by pickle's protocol 5 with buffers that cannot be written, as an object store hands them out."""
    buffers = []
    data = pickle.dumps(thing, protocol=5, buffer_callback=buffers.append)
    return pickle.loads(data, buffers=[bytes(buffer.raw()) for buffer in buffers])


@pytest.mark.parametrize("arguments", [{}, RANDOM], ids=["plain", "random"])
@pytest.mark.parametrize("kind", [ElbowArmEnv, ElbowArmVectorEnv])
def test_an_environment_that_arrives_read_only_steps_and_resets_and_compiles_nothing_again(kind, arguments):
    size = {"num_envs": 5} if kind is ElbowArmVectorEnv else {}
    env = played(kind(**size, **arguments))
    entry = env.episodes.simulator._kernel.control_step
    signatures = len(getattr(entry, "signatures", ()))
    there = arrived(env)
    act = ACTIONS if size else ACTIONS[:, 0]
    for one in act[:8]:
        assert same(there.step(one), env.step(one))
    assert same(there.reset(), env.reset())
    assert same(there.step(act[0]), env.step(act[0]))
    assert len(getattr(entry, "signatures", ())) == signatures


def test_a_simulator_that_arrives_read_only_steps_and_resets():
    simulator = Simulator(num_envs=3)
    there = arrived(simulator)
    there.step(np.ones(10))
    simulator.step(np.ones(10))
    assert same(there.get_state(), simulator.get_state())
    there.reset(mask=np.array([True, False, True]))
    assert there.time.tolist() == [0.0, 0.002, 0.0]


def test_read_only_and_unaligned_actions_compile_nothing_again():
    env, twin = played(ElbowArmEnv()), played(ElbowArmEnv())
    entry = kernel(1).control_step
    signatures = len(getattr(entry, "signatures", ()))
    fixed = ACTIONS[0, 0].astype(np.float64)
    odd = np.frombuffer(b"-" + fixed.tobytes(), dtype=np.float64, offset=1)
    expected = twin.step(fixed.copy()), twin.step(fixed.copy())
    fixed.flags.writeable = False
    assert same((env.step(fixed), env.step(odd)), expected)
    assert len(getattr(entry, "signatures", ())) == signatures


def test_a_partial_reset_shows_the_other_arms_as_they_were_last_seen():
    batch = ElbowArmVectorEnv(5, **RANDOM, autoreset_mode="Disabled")
    batch.reset(seed=4)
    twin = ElbowArmVectorEnv(5, **RANDOM, autoreset_mode="Disabled")
    twin.reset(seed=4)
    for action in ACTIONS[:3]:
        last, *_ = batch.step(action)
        twin.step(action)
    mask = np.array([True, False, False, True, False])
    shown, _ = batch.reset(options={"reset_mask": mask})
    np.testing.assert_array_equal(shown[~mask], last[~mask])
    assert (shown[mask] != last[mask]).any(axis=1).all()
    # Showing them again has drawn nothing.
    np.testing.assert_array_equal(batch.step(ACTIONS[3])[0][~mask], twin.step(ACTIONS[3])[0][~mask])
    state = batch.get_state()
    last = batch.step(ACTIONS[4])[0]
    batch.set_state(state)
    np.testing.assert_array_equal(batch.step(ACTIONS[4])[0], last)

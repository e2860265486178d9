"""Anything as arguments, reset options, actions and states: never a NaN, a half change or an error of another's code.

The short form runs everywhere; `pytest -m soak` runs the long one, with as many examples as FUZZ_EXAMPLES says.
"""

import copy
import functools
import os
import warnings

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from hypothesis import given, settings
from hypothesis import strategies as st

from elbow_gym import ElbowArmEnv, ElbowArmVectorEnv, paper_arm
from elbow_gym.task.circle import Circle
from elbow_gym.task.randomization import FACTORS, NUMBERS
from elbow_gym.task.settings import Settings

SHORT, LONG = 60, int(os.environ.get("FUZZ_EXAMPLES", "5000"))
FORMS = [pytest.param(SHORT, id="short"), pytest.param(LONG, id="long", marks=pytest.mark.soak)]
same = functools.partial(data_equivalence, exact=True)

# No switch of the physics here: each set of them would compile a kernel.
NAMES = sorted(
    set(Settings.__dataclass_fields__)
    - {"table", "heat", "elbow_friction", "supply_resistance", "gear_coulomb_friction", "integrator"}
)
numbers = st.one_of(
    st.floats(),
    st.floats(-2.0, 2.0),
    st.integers(-3, 12),
    st.sampled_from([10**400, -(10**400), 2**63, 1e308, 5e-324, -0.0]),
)
scalars = st.one_of(st.none(), st.booleans(), numbers, st.text(max_size=3), st.sampled_from(["random", "xy", "volt"]))
anything = st.recursive(
    scalars,
    lambda part: st.one_of(
        st.lists(part, max_size=4),
        st.dictionaries(st.text(max_size=3), part, max_size=3),
        st.lists(numbers, min_size=10, max_size=10),
    ),
    max_leaves=8,
)
arrays = st.sampled_from(
    [
        np.array(1.0),
        np.zeros(10),
        np.full(10, np.nan),
        np.zeros((1, 10), np.float32),
        np.zeros(10, complex),
        np.array(["up"] * 10),
        np.array([10**400] * 10, dtype=object),
        np.array([None]),
        np.zeros((3, 10)),
        np.zeros(0),
        np.arange(10),
        np.full(10, 1e308),
        np.zeros((3, 10))[:, ::2],
        np.zeros(10, ">f8"),
        b"0123456789",
        {1, 2},
        object(),
    ]
)
values = st.one_of(anything, arrays)
circles = st.dictionaries(st.sampled_from(sorted(Circle.__dataclass_fields__)), values, max_size=3)
draws = st.dictionaries(
    st.sampled_from([*FACTORS, *NUMBERS]),
    st.one_of(values, st.tuples(numbers, numbers).map(list), st.just([0.9, 1.1])),
    max_size=3,
)


@st.composite
def arms(draw):
    """The dict of an arm with some entries replaced."""
    arm = paper_arm().to_dict()
    for _ in range(draw(st.integers(1, 3))):
        name = draw(st.sampled_from(sorted(arm)))
        if name in ("links", "motors") and draw(st.booleans()):
            part = copy.deepcopy(arm[name])
            place = part[draw(st.integers(0, len(part) - 1))] if isinstance(part, list) and part else None
            if isinstance(place, dict):
                place[draw(st.sampled_from(sorted(place)))] = draw(values)
            arm[name] = part
        else:
            arm[name] = draw(values)
    return arm


OF_ARGUMENT = {"circle": circles, "randomize": draws, "arm": arms()}
arguments = st.lists(st.sampled_from(NAMES), max_size=3, unique=True).flatmap(
    lambda names: st.fixed_dictionaries({name: st.one_of(values, OF_ARGUMENT.get(name, values)) for name in names})
)
options = st.one_of(
    values,
    st.fixed_dictionaries(
        {},
        optional={
            "state": st.one_of(
                values,
                st.dictionaries(st.sampled_from(["q", "q_dot", "current", "temperature_rise"]), values, max_size=3),
            ),
            "phase": values,
            "circle": st.one_of(values, circles),
            "parameters": st.one_of(values, draws),
            "reset_mask": st.one_of(values, st.just(np.array([True, False, True]))),
        },
    ),
)


def finite(answer):
    """Whether all numbers in an answer, infos included, are finite."""
    if isinstance(answer, dict):
        return all(finite(part) for part in answer.values())
    if isinstance(answer, list | tuple):
        return all(finite(part) for part in answer)
    return answer is None or np.asarray(answer).dtype.kind not in "fc" or bool(np.isfinite(answer).all())


REFUSED = object()


def attempt(call, *args, **kwargs):
    """A call's answer, or REFUSED where this project's code raises a ValueError with a rule; all else is raised."""
    try:
        return call(*args, **kwargs)
    except ValueError as error:
        place = error.__traceback__
        while place.tb_next is not None:
            place = place.tb_next
        if os.sep + "elbow_gym" + os.sep not in place.tb_frame.f_code.co_filename or "must" not in str(error):
            raise
        return REFUSED


def plays(env, action):
    """Makes an episode's first steps, all of whose numbers must be finite."""
    assert finite(env.reset(seed=0))
    for _ in range(2):
        answer = env.step(action)
        assert finite(answer)
        assert answer[0] in env.observation_space


@pytest.mark.parametrize("examples", FORMS)
def test_any_arguments_make_an_environment_that_plays_or_are_refused_by_name(examples):
    @settings(max_examples=examples)
    @given(arguments)
    def check(given_arguments):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            env = attempt(ElbowArmEnv, **given_arguments)
            if env is not REFUSED:
                attempt(plays, env, np.zeros(env.action_space.shape, np.float32))

    check()


RANDOM = {"randomize": {"mass": [0.9, 1.1], "sensor_noise": [0.0, 0.01]}, "circle": {"phase": "random"}}


@functools.cache
def three():
    return ElbowArmVectorEnv(3, **RANDOM)


@pytest.mark.parametrize("examples", FORMS)
def test_any_options_start_episodes_or_are_refused_with_nothing_changed(examples):
    env = three()

    @settings(max_examples=examples)
    @given(options)
    def check(given_options):
        env.reset(seed=1)
        before = env.get_state()
        answer = attempt(env.reset, options=given_options)
        if answer is REFUSED:
            assert same(env.get_state(), before)
            return
        assert finite(answer)
        assert finite(env.step(np.zeros((3, 10), np.float32)))
        # Other parameters stay until they are drawn again.
        env.set_state(before)

    check()


@pytest.mark.parametrize("examples", FORMS)
def test_any_actions_make_a_step_or_are_refused_with_nothing_changed(examples):
    env = ElbowArmEnv()
    env.reset(seed=1)

    @settings(max_examples=examples)
    @given(values)
    def check(action):
        before = env.get_state()
        answer = attempt(env.step, action)
        assert same(env.get_state(), before) if answer is REFUSED else finite(answer)

    check()


def places(state, path=()):
    """Paths to all entries of a state, dicts and lists inside included."""
    parts = state.items() if isinstance(state, dict) else enumerate(state) if isinstance(state, list) else ()
    for name, part in parts:
        yield (*path, name)
        yield from places(part, (*path, name))


@pytest.mark.parametrize("examples", FORMS)
def test_any_state_goes_on_or_is_refused_with_nothing_changed(examples):
    env = three()
    env.reset(seed=1)
    env.step(np.ones((3, 10), np.float32))
    before = env.get_state()
    paths = list(places(before))

    @settings(max_examples=examples)
    @given(st.data())
    def check(data):
        state = copy.deepcopy(before)
        path = data.draw(st.sampled_from(paths))
        place = functools.reduce(lambda part, name: part[name], path[:-1], state)
        entry = place[path[-1]]
        if isinstance(entry, np.ndarray) and entry.size and data.draw(st.booleans()):
            number = data.draw(st.floats() if entry.dtype.kind == "f" else st.integers(-(2**63), 2**63 - 1))
            entry.flat[data.draw(st.integers(0, entry.size - 1))] = number
        elif data.draw(st.booleans()):
            del place[path[-1]]
        else:
            place[path[-1]] = data.draw(values)
        if attempt(env.set_state, state) is REFUSED:
            assert same(env.get_state(), before)
            return
        if np.all(state["started"]):
            assert finite(env.step(np.zeros((3, 10), np.float32)))
        env.set_state(before)

    check()

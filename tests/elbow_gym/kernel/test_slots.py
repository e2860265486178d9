"""The kernel's workspace: what its passes say of the slots they use is so, and shared rows are never live twice."""

import ast
import inspect
import re
import textwrap

import numpy as np
import pytest

from elbow_gym import paper_arm
from elbow_gym.kernel import control, rows, slots
from elbow_gym.kernel.template import TEMPLATES, instances
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_table
from elbow_gym.table import TableParameters

FIXED = {"U", "LANES", "NEXT", "W", "STRIDE", "BLOCK_LANES"}
SHARED = {
    "FORCES", "BELOW", "SHIFT", "ACTIVE", "MATRIX", "COUPLING", "FREE_RISE", "SLIDE_R", "SLIDE_T", "PUSHING", "PUSH",
    "PUSH_LIMIT", "DRIFT", "ASTRAY", "RADIAL_RISE", "MOBILITY", "COME_UP", "STEP",
}  # fmt: skip
SLOTS = {name for name, value in vars(slots).items() if isinstance(value, np.uint64)} - FIXED | {"X", "Y"}


def row_of(name):
    """Row of a slot in a record."""
    return int(getattr(slots, name)) // slots.W


def uses(function):
    """Names of the slots that a template reads and writes, by its code."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    # Offsets that are kept in local variables, such as `force = FORCES + ...`.
    kept = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            kept.setdefault(node.targets[0].id, []).append(node.value)

    def names(index):
        for node in ast.walk(index):
            if isinstance(node, ast.Name) and node.id in SLOTS:
                yield node.id
            elif isinstance(node, ast.Name) and node.id not in ("k", "here", "parent", "child", "o"):
                for value in kept.get(node.id, ()):
                    yield from names(value)

    read, written = set(), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id in ("ws", "shared"):
            (written if isinstance(node.ctx, ast.Store) else read).update(names(node.slice))
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Subscript):
            read.update(names(node.target.slice))
    return read, written


def said(function):
    """The same by its docstring."""
    doc = " ".join((inspect.getdoc(function) or "").split())
    found = [re.search(rf"{word}: ([A-Z0-9_, ]+)\.", doc) for word in ("Reads", "Writes")]
    return tuple(set() if match is None else set(match[1].split(", ")) for match in found)


@pytest.mark.parametrize("name", sorted(TEMPLATES))
def test_passes_read_and_write_the_slots_that_they_say(name):
    assert said(TEMPLATES[name].function) == uses(TEMPLATES[name].function)


def test_every_slot_is_used_and_every_row_has_a_meaning_of_its_own():
    used = set().union(*(set.union(*uses(each.function)) for each in TEMPLATES.values()))
    assert used == SLOTS
    plain = {int(value) for name, value in vars(slots).items() if name in SLOTS - SHARED}
    assert {row * slots.W for row in range(len(slots.MEANINGS))} <= plain
    assert len(set(slots.MEANINGS)) == len(slots.MEANINGS)


def test_a_reused_row_is_the_one_that_the_table_says():
    for name, other in slots.REUSED.items():
        assert getattr(slots, name) == getattr(slots, other)


def test_no_two_other_slots_are_the_same_row():
    for lanes in (1, 16):
        for on in (False, True):
            known = slots.offsets(lanes, table=on, rubbing=on, drive=on)
            absent = set() if on else {"X", *(name for name in SLOTS - {"X", "Y"} if row_of(name) >= slots.SLOTS)}
            record = [int(known[name]) for name in SLOTS - SHARED - set(slots.REUSED) - absent]
            assert len(set(record)) == len(record)
            assert max(record) + lanes * rows.MAXIMUM_ELBOWS <= known["STRIDE"]
            shared = [int(known[name]) for name in SHARED]
            assert len(set(shared)) == len(shared)


def moving_arms(on):
    """States, parameters and voltages of two arms in motion, on their elbows and in part under the table."""
    rng = np.random.default_rng(3)
    options = Conditions(
        payload=0.2,
        table=TableParameters(friction=0.3) if on["table"] else None,
        elbow_friction=0.2 if on["rubbing"] else 0.0,
        heat=on["drive"],
        supply_resistance=0.1 if on["drive"] else 0.0,
    )
    nominal = parameter_table(paper_arm(), options)
    parameters = nominal * rng.uniform(0.9, 1.1, (2, rows.PARAMETER_ROWS, 1))
    state = np.zeros((2, rows.SWITCHED_STATE_ROWS if any(on.values()) else rows.STATE_ROWS, 10))
    state[:, 0] = paper_arm().nominal_pose + 0.1 * rng.normal(size=(2, 10))
    state[:, 1:3] = rng.normal(size=(2, 2, 10))
    return state, parameters, rng.uniform(-24.0, 24.0, (2, 10))


@pytest.mark.parametrize(
    "switches", [(), ("classical", "drive"), ("table",), ("rubbing",), ("drive",), ("table", "rubbing", "drive")]
)
def test_no_two_live_quantities_share_a_row(switches):
    # A row of its own for every quantity changes nothing, so no pass finds another's value in a shared one.
    on = {name: name in switches for name in ("table", "rubbing", "drive")}

    def run(reuse):
        known = slots.offsets(1, **on, exponential="classical" not in switches, reuse=reuse)
        entry = instances(known, "interpreted", lambda function, **_: function)[control.control_step.__name__]
        state, parameters, voltage = moving_arms(on)
        summary = np.zeros((len(state), rows.SUMMARY_COLUMNS + 2))
        own = (state, parameters, np.array([4, 7]), np.array([1e-3, 2e-3]), summary)
        assert entry(voltage, voltage, control.NO_QUEUE, *own, *control.NO_TASK, 0, len(state)) == 0
        return state, summary

    for shared, own in zip(run(True), run(False), strict=True):
        np.testing.assert_array_equal(shared, own)

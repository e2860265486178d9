"""Checks of states: elbows on the table, and saved arrays before they are restored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elbow_gym.checks import as_dict, require_entries, saved_rows
from elbow_gym.kernel.rows import BELOW_TABLE, LARGEST_ANGLE, STATE, VALID
from elbow_gym.kinematics import pitches
from elbow_gym.parameters import Array

# A given pose may be off the elbows' plane by this much [m], its rates by this much [m/s].
PLANE_TOLERANCE = 1e-8
RATE_TOLERANCE = 1e-6
# A running state may be off by these times as much, and more where joints are faster than 1 rad/s.
DRIFT = 100.0
# Rows of the state that only grow.
GROWING = [STATE.index(name) for name in ("drawn_energy", "copper_loss", "friction_loss")]


def check_angles(name: str, q: Array) -> None:
    """Raises ValueError naming `name` where an angle [rad] is beyond what an arm can represent."""
    if np.abs(q).max() >= LARGEST_ANGLE:
        raise ValueError(f"{name} must be within {LARGEST_ANGLE:g} rad, got {np.abs(q).max():g}")


def check_on_table(elbows: Sequence[int], q: Array, q_dot: Array, length: Array, slack: float = 1.0) -> None:
    """Raises ValueError naming an elbow that is not at z = 0 or moves off it.

    Args:
        elbows: joint numbers.
        q: relative angles [rad], (k, n).
        q_dot: rates [rad/s], (k, n).
        length: lengths of the links [m], (k, n).
        slack: factor on the tolerances of 1e-8 m and 1e-6 m/s.
    """
    joints = [elbow - 2 for elbow in elbows]
    height = np.abs(np.cumsum(length * np.cos(pitches(q)), axis=-1)[:, joints])
    if height.size and height.max() > slack * PLANE_TOLERANCE:
        joint, within = elbows[int(height.max(axis=0).argmax())], f"{slack * PLANE_TOLERANCE:g} m"
        raise ValueError(f"q must hold elbow joint {joint} at z = 0 to {within}, got {height.max():.6g} m off")
    with np.errstate(over="ignore", invalid="ignore"):
        rise = np.abs(np.cumsum(length * np.sin(pitches(q)) * pitches(q_dot), axis=-1)[:, joints])
    if rise.size and not rise.max() <= slack * RATE_TOLERANCE:
        raise ValueError(f"q_dot must keep the elbows at z = 0, got {rise.max():.6g} m/s off the table")


def checked_arrays(
    own: Mapping[str, NDArray[Any]], state: object, elbows: Sequence[int], length: Array
) -> dict[str, NDArray[Any]]:
    """Arrays of a simulator's saved state of k arms by name.

    Args:
        own: the simulator's arrays `state`, `summary`, `clock` and `motion`.
        state: the saved state.
        elbows: joint numbers.
        length: lengths of the arms' links [m], (k, n).

    Raises ValueError naming an array that is missing, of another size, not finite, negative where it counts, or that
    has an elbow off the table.
    """
    given = as_dict("state", state)
    require_entries(given, own, "state")
    saved = {name: saved_rows(f"state[{name!r}]", given[name], array, len(length)) for name, array in own.items()}
    if saved["clock"].min() < 0:
        raise ValueError(f"state['clock'] must not be negative, got {saved['clock'].min()}")
    if saved["motion"].min() < 0.0:
        raise ValueError(f"state['motion'] must not be negative, got {saved['motion'].min():g} J")
    meters, valid = saved["state"][:, GROWING], saved["summary"][:, VALID]
    if meters.min() < 0.0:
        raise ValueError(f"state['state'] must have no negative losses, got {meters.min():g} J")
    if not ((valid == 0.0) | (valid == 1.0)).all() or saved["summary"][:, BELOW_TABLE].min() < 0.0:
        raise ValueError("state['summary'] must be of `get_state`, got a time below the table or a mark that is not")
    q, q_dot = saved["state"][:, 0], saved["state"][:, 1]
    check_angles("q", q)
    if elbows:
        check_on_table(elbows, q, q_dot, length, DRIFT * max(1.0, float(np.abs(q_dot).max())))
    return saved

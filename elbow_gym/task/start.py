"""Start states of episodes: poses drawn and raised above a compliant table, given ones checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from elbow_gym.checks import check_entries, require_entries
from elbow_gym.kernel.rows import PARAMETERS
from elbow_gym.kinematics import inverse_kinematics, pitches, reaching_pose
from elbow_gym.parameters import Array
from elbow_gym.simulation.rates import Start
from elbow_gym.simulation.state_checks import PLANE_TOLERANCE
from elbow_gym.simulator import Simulator
from elbow_gym.task.arm_batch import Population
from elbow_gym.task.circle import Circle
from elbow_gym.task.settings import Settings

STATE_ENTRIES = ("q", "q_dot", "current", "temperature_rise")
# Raising links between rigid elbows and putting these back on the table comes closer each time [rounds].
ROUNDS = 200
TRIES = 1000
"""Most poses that are drawn for an arm until one will do, as one in three does of the paper's arm."""


def given_state(state: object) -> dict[str, Any] | None:
    """The reset option `state` with its names checked."""
    if state is None:
        return None
    if not isinstance(state, Mapping):
        raise ValueError(f"options['state'] must be a dict, got {state!r}")
    plain = cast("Mapping[str, Any]", state)
    check_entries(plain, set(STATE_ENTRIES), "options['state']")
    require_entries(plain, ("q",), "options['state']")
    return dict(plain)


def checked_state(simulator: Simulator, state: Mapping[str, Any], mask: NDArray[np.bool_] | None) -> Start:
    """What moves or is warm in the chosen arms' given states.

    Raises ValueError as `Simulator.check_state` does, and where a joint or the hand lies deeper in the compliant table
    than (n - 1) times the weight of arm and payload presses it at one point: as all of them would that stretch out from
    the end of one link.
    """
    q, q_dot, current, rise, chosen = simulator.check_state(**state, mask=mask)
    surface = simulator.conditions.surface
    if surface is not None:
        rows = simulator.parameters(np.flatnonzero(chosen))
        mass, gravity, payload = (rows[:, PARAMETERS.index(name)] for name in ("mass", "gravity", "payload"))
        weight = gravity[:, 0] * (mass.sum(axis=1) + payload[:, 0])
        deepest = (mass.shape[1] - 1) * weight / surface.stiffness
        depth = np.maximum(-_heights(q[chosen], rows), 0.0)
        excess = depth - deepest[:, None]
        if excess.max() > 0.0:
            arm, point = np.unravel_index(int(excess.argmax()), excess.shape)
            raise ValueError(
                f"options['state'] q must have joint {point + 3} at most {deepest[arm]:.3g} m deep in the table (joint "
                f"{mass.shape[1] + 1} is the hand), got {depth[arm, point]:.6g} m"
            )
    return Start(q_dot[chosen], current[chosen], rise[chosen])


def drawn_poses(
    settings: Settings,
    simulator: Simulator,
    population: Population,
    pose: Array,
    generators: Sequence[np.random.Generator],
    circles: Sequence[Circle],
    chosen: NDArray[np.int64],
) -> Array:
    """Poses of all arms [rad], (B, n), those of the chosen ones (k,) as their episodes start.

    Args:
        settings: the environment's arguments.
        simulator: simulator of the arms.
        population: parameters of the arms.
        pose: start pose of the nominal arm [rad], (n,).
        generators: random generators of the chosen arms, which draw the spread, then the noise.
        circles: circles of the chosen arms.
        chosen: numbers of arms, (k,).
    """
    noise, moved = settings.start_noise, "length" in settings.randomization.ranges
    moved = moved or population.changed
    q = np.tile(pose, (simulator.num_envs, 1))
    if moved:
        q = simulator.on_table(q)
    if settings.start == "on_target":
        arms = population.arms(chosen) if moved else [simulator.arm] * len(chosen)
        for i, arm, circle in zip(chosen, arms, circles, strict=True):
            target = circle.position(float(circle.phase))
            try:
                q[i] = inverse_kinematics(arm, q[i], target)[0]
            except ValueError:
                # The last two links do not reach everywhere that drawn circles may be.
                q[i] = reaching_pose(arm, q[i], simulator.elbows, target)
    elif settings.start_spread > 0.0:
        q = spread_poses(simulator, q, settings.start_spread, generators, chosen)
    if noise > 0.0:
        q[chosen] += noise * np.stack([generator.standard_normal(simulator.arm.n_joints) for generator in generators])
        q = simulator.on_table(q)
    return q if settings.conditions.surface is None else above_table(simulator, q)


def spread_poses(
    simulator: Simulator,
    q: Array,
    spread: float,
    generators: Sequence[np.random.Generator],
    chosen: NDArray[np.int64],
) -> Array:
    """Poses [rad], (B, n), in which every joint of the chosen arms (k,) is within `spread` of `q` and at z >= 0.

    An arm's generator draws `uniform(-spread, spread, n)`, which is put on the elbows' plane, until it is so.

    Raises ValueError where it does not find such a pose.
    """
    everyone, drawn = simulator.parameters(np.arange(simulator.num_envs)), q
    sought = np.zeros(simulator.num_envs, dtype=np.bool_)
    sought[chosen] = True
    for _ in range(TRIES):
        tried = q.copy()
        for i, generator in zip(chosen, generators, strict=True):
            if sought[i]:
                tried[i] += generator.uniform(-spread, spread, q.shape[1])
        drawn = np.where(sought[:, None], simulator.on_table(tried), drawn)
        far = np.abs(drawn - q).max(axis=1) > spread + PLANE_TOLERANCE
        sought &= far | (_heights(drawn, everyone).min(axis=1) < -PLANE_TOLERANCE)
        if not sought.any():
            return drawn
    pose = q[sought][0].round(4).tolist()
    raise ValueError(f"start_spread must allow poses above the table, got none in {TRIES} draws about {pose}")


def above_table(simulator: Simulator, q: Array) -> Array:
    """Poses (B, n) [rad] whose joints and hand are not below the compliant table, with the elbows at z = 0.

    From base to tip, a link whose end is below z = 0 is turned until its end lies on the table; the other links keep
    their absolute pitch. Poses that are above it already stay as they are.

    Raises ValueError where rigid elbows leave no such pose near one of `q`.
    """
    everyone = simulator.parameters(np.arange(simulator.num_envs))
    for _ in range(ROUNDS):
        if _heights(q, everyone).min() >= -PLANE_TOLERANCE:
            return q
        q = _raised(q, everyone)
        if simulator.elbows:
            q = simulator.on_table(q)
    raise ValueError(
        f"start_noise must leave poses above the table with the elbows {simulator.elbows} at z = 0, got a joint "
        f"{-_heights(q, everyone).min():.3g} m below"
    )


def _heights(q: Array, rows: Array) -> Array:
    """Heights of joints 3..n and, last, the hand [m], (k, n - 1)."""
    return np.cumsum(rows[:, PARAMETERS.index("length")] * np.cos(pitches(q)), axis=1)[:, 1:]


def _raised(q: Array, rows: Array) -> Array:
    length, pitch = rows[:, PARAMETERS.index("length")], pitches(q)
    turn, height = np.zeros_like(q), np.zeros(len(q))
    for a in range(1, q.shape[1]):
        low = height + length[:, a] * np.cos(pitch[:, a]) < -PLANE_TOLERANCE
        # The nearest pitch that puts the end at z = 0: the link's start is above that, by less than its length.
        wrapped = np.arctan2(np.sin(pitch[:, a]), np.cos(pitch[:, a]))
        lying = np.copysign(np.arccos(np.clip(-height / length[:, a], -1.0, 1.0)), wrapped)
        turn[:, a] = np.where(low, lying - wrapped, 0.0)
        height = height + length[:, a] * np.cos(pitch[:, a] + turn[:, a])
    return q + np.diff(turn, axis=1, prepend=0.0)

"""Posture of the redundant joints that holds the arm over the circle with least copper loss."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.control.inverse_dynamics import InverseDynamics
from elbow_gym.kinematics import constraint_jacobian, inverse_kinematics, on_table, pitches
from elbow_gym.parameters import ArmParameters
from elbow_gym.task.circle import Circle

Array = NDArray[np.float64]

CIRCLE_POINTS = 8
SPREAD = 1.0
"""Standard deviation of the poses that a search starts from [rad]."""
BEND = 0.2
"""Least bend of the last joint [rad]: stretched, the hand could not follow both ways."""
LARGEST = np.pi
"""Bound of every angle [rad], twice that of the last two joints where no posture keeps to it."""
WAY_STEPS = 200
"""Steps of the way from the start pose to a posture."""
LEAST_LEVER = 0.02
"""Height that elbows gain by a turn of the joints, over the longest link, below which they count as stuck [1/rad]."""
ARRIVED = 1e-3
"""Largest difference of an angle at the end of the way [rad]."""
NUDGE = 2.0**-26
"""Step of the forward differences [rad], SciPy's own."""


@dataclass(frozen=True)
class Posture:
    """Pose of the idle joints, and the copper loss of holding the arm in it."""

    pose: Array
    """Joint angles [rad], (n,); joints 1, n-1 and n are those for the circle's first point."""
    copper_loss: float
    """Mean of sum R i^2 at rest over the circle [W]."""


def static_copper_loss(arm: ArmParameters, elbows: Sequence[int], q: Array) -> Array:
    """Sum of R i^2 at rest [W], (...), at poses [rad], (..., n), with the elbow forces of least loss."""
    return _loss_at_rest(InverseDynamics(arm, elbows), q)


def _loss_at_rest(inverse: InverseDynamics, q: Array) -> Array:
    return (inverse.resistance * inverse.hold(q).current ** 2).sum(axis=-1)


def best_postures(
    arm: ArmParameters,
    elbows: Sequence[int],
    circle: Circle,
    above_table: bool = True,
    starts: int = 12,
    seed: int = 0,
    payload: float = 0.0,
) -> list[Posture]:
    """Local minima of the static copper loss over the joints 2..n-2, the best first.

    Joints 1, n-1 and n put the hand on the circle; elbows stay at z = 0 and, with `above_table`, no joint is below it.

    Args:
        arm: the arm.
        elbows: joint numbers held at z = 0.
        circle: the hand's path.
        above_table: whether every joint and the hand must have z >= 0.
        starts: searches, one from the arm's nominal pose and the others from normal noise about it.
        seed: seed of the noise.
        payload: point mass at the hand [kg].

    Raises:
        ValueError: no search found a posture that meets its conditions.
    """
    from scipy.optimize import minimize
    from threadpoolctl import threadpool_limits

    n, nominal, length = arm.n_joints, np.array(arm.nominal_pose), arm.of_links("length")
    start = circle.position(0.0)
    target = circle.position(2.0 * np.pi / CIRCLE_POINTS * np.arange(CIRCLE_POINTS))
    wanted = np.stack([np.hypot(target[:, 0], target[:, 1]), target[:, 2]], axis=-1)
    free = np.array([k for k in range(2, n + 1) if k + 1 not in elbows])
    inverse = InverseDynamics(arm, elbows, payload)

    def poses(angles: Array) -> Array:
        """The idle joints' angles, then one pair of the last two joints per point, as poses (..., points, n)."""
        leading = angles.shape[:-1]
        first = np.broadcast_to(nominal[:1], (*leading, CIRCLE_POINTS, 1))
        idle = np.broadcast_to(angles[..., None, : n - 3], (*leading, CIRCLE_POINTS, n - 3))
        return np.concatenate([first, idle, angles[..., n - 3 :].reshape(*leading, CIRCLE_POINTS, 2)], axis=-1)

    def ends(angles: Array) -> Array:
        phi = pitches(poses(angles))
        return np.stack([np.cumsum(length * np.sin(phi), axis=-1), np.cumsum(length * np.cos(phi), axis=-1)], axis=-1)

    def loss(angles: Array) -> Array:
        return _loss_at_rest(inverse, poses(angles)).mean(axis=-1)

    def held(angles: Array) -> Array:
        places = ends(angles)
        off = (places[..., -1, :] - wanted).reshape(*angles.shape[:-1], 2 * CIRCLE_POINTS)
        return np.concatenate([off, places[..., 0, [e - 2 for e in elbows], 1]], axis=-1)

    def bent(angles: Array) -> Array:
        return angles[..., n - 2 :: 2] - BEND

    def above(angles: Array) -> Array:
        return ends(angles)[..., free - 1, 1].reshape(*angles.shape[:-1], -1)

    conditions = [_condition("eq", held), _condition("ineq", bent)]
    if above_table:
        conditions.append(_condition("ineq", above))

    def following(idle: Array) -> Array:
        """Angles of the last two joints that follow the circle, a pair for each point; ValueError where none do."""
        q = inverse_kinematics(arm, np.concatenate([nominal[:1], idle, nominal[-2:]]), target)[0]
        return np.unwrap(q[:, -2:], axis=0).ravel()

    def searched(again: bool) -> list[Posture]:
        """Postures of all searches; again: from poses that follow the circle, over more than a turn of joint n-1."""
        limit = 2.0 * LARGEST if again else LARGEST
        rng = np.random.default_rng(seed)
        found: list[Posture] = []
        for k in range(starts):
            idle = np.clip(nominal[1:-2] + (rng.normal(scale=SPREAD, size=n - 3) if k else 0.0), -3.0, 3.0)
            pairs = np.tile(nominal[-2:], CIRCLE_POINTS)
            if again:
                with suppress(ValueError):
                    pairs = following(idle)
            guess = np.concatenate([idle, pairs])
            # BLAS adds up in another order on more threads, and where a flat valley's search ends shows it.
            with threadpool_limits(1, user_api="blas"):
                best = minimize(
                    lambda angles: float(loss(angles)),
                    guess,
                    method="SLSQP",
                    jac=partial(slopes, loss),
                    constraints=conditions,
                    bounds=[(-LARGEST, LARGEST)] * (n - 3) + [(-limit, limit)] * (2 * CIRCLE_POINTS),
                    options={"maxiter": 300, "ftol": 1e-6},
                )
            met = all((c["fun"](best.x) > -1e-6).all() for c in conditions) and (np.abs(held(best.x)) < 1e-6).all()
            # A last joint bent by a whole turn is stretched, and rounding can put the hand out of its reach.
            with suppress(ValueError):
                if met:
                    pose = inverse_kinematics(arm, poses(best.x)[0], start)[0]
                    found.append(Posture(pose, float(best.fun)))
        return found

    found = searched(again=False) or searched(again=True)
    if not found:
        raise ValueError(
            f"circle must allow a posture with the elbows {tuple(elbows)} down, got none in {starts} searches"
        )
    return sorted(found, key=lambda posture: posture.copper_loss)


def leads_to(arm: ArmParameters, elbows: Sequence[int], pose: Array) -> bool:
    """Whether the straight way from the start pose to a pose [rad], (n,), bent onto the elbows' plane, arrives there.

    Elbows that fold over to the other side would pass through a pose in which they cannot move up or down.
    """
    q = on_table(arm, arm.nominal_pose, elbows)
    for left in range(WAY_STEPS, 0, -1):
        try:
            q = on_table(arm, q + (pose - q) / left, elbows)
        except ValueError:
            return False
        lever = np.linalg.svd(constraint_jacobian(arm, q, elbows), compute_uv=False).min(initial=np.inf)
        if lever < LEAST_LEVER * arm.of_links("length").max():
            return False
    return bool(np.abs(q - pose).max() < ARRIVED)


def _condition(kind: str, function: Callable[[Array], Array]) -> dict[str, Any]:
    return {"type": kind, "fun": function, "jac": partial(slopes, function)}


def slopes(function: Callable[[Array], Array], angles: Array) -> Array:
    """Forward differences of a function of angles [1/rad], (k, m) or (m,), from one call with all of them as a batch.

    Args:
        function: maps angles [rad], (..., m), to values (..., k) or (...).
        angles: where the slopes are taken [rad], (m,), within `LARGEST`, which the steps do not leave either.
    """
    nudged = angles + np.diag(np.where(angles + NUDGE > LARGEST, -NUDGE, NUDGE))
    values = function(np.concatenate([angles[None], nudged]))
    return (values[1:] - values[0]).T / (np.diagonal(nudged) - angles)

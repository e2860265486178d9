"""Checks of an installation: versions, compilation, known rollouts, the paper's equations, libraries' checkers."""

from __future__ import annotations

import hashlib
import json
import platform
import time
import warnings
from collections.abc import Callable, Mapping
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils.env_checker import check_env

import elbow_gym
from elbow_gym.dynamics import bias_forces, forward_dynamics
from elbow_gym.env import ElbowArmEnv
from elbow_gym.kernel.build import kernel
from elbow_gym.kernel.cache import folder
from elbow_gym.kernel.rows import STATE_ROWS
from elbow_gym.kinematics import constraint_jacobian
from elbow_gym.parameters import Array, paper_arm
from elbow_gym.simulation.options import Conditions
from elbow_gym.simulation.parameter_rows import parameter_table
from elbow_gym.vector_env import ElbowArmVectorEnv

GOLDEN = Path(__file__).parent / "golden.json"
"""Hashes of rollouts by name, which `tests/make_golden.py` writes."""
ROLLOUTS: dict[str, dict[str, Any]] = {
    "elbows 0": {"elbows": 0},
    "elbows 1": {"elbows": 1},
    "elbows 2": {"elbows": 2},
}
"""Arguments of the environments whose rollouts are hashed, by name."""
# All that libraries for linear algebra and random numbers may round differently is left out or fixed.
FIXED: dict[str, Any] = {"timestep": 0.002, "start_noise": 0.0, "duration": 1.0}
LIBRARIES = ("gymnasium", "numpy", "numba", "scipy", "stable-baselines3")
SAME = 1e-9
"""Largest difference between two forms of the same equations, as a share of the largest entry."""


def rollout(arguments: dict[str, Any]) -> str:
    """Hash of an episode of three arms under seeded actions: observations, rewards and energies, to the last bit."""
    env = ElbowArmVectorEnv(3, **FIXED, **arguments)
    digest = hashlib.sha256(env.reset(seed=0)[0].tobytes())
    for action in np.random.default_rng(0).uniform(-1.0, 1.0, (50, 3, 10)):
        observation, reward, *_, info = env.step(action)
        digest.update(observation.tobytes() + reward.tobytes() + info["electrical_energy"].tobytes())
    return digest.hexdigest()


def versions() -> str:
    """Versions of Python and of the libraries; those that are not installed are left out."""
    found = [f"elbow_gym {elbow_gym.__version__}", f"Python {platform.python_version()} on {platform.machine()}"]
    for name in LIBRARIES:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    return ", ".join(found)


def compilation() -> str:
    """A step of one arm and of a batch, for which the kernel is compiled or taken from the cache."""
    started = time.perf_counter()
    for num_envs in (1, 3):
        env = ElbowArmVectorEnv(num_envs)
        env.reset(seed=0)
        env.step(np.zeros((num_envs, 10), np.float32))
    return f"ready after {time.perf_counter() - started:.1f} s, cache {folder() or 'nowhere: no folder can be written'}"


def golden_rollouts() -> str:
    """Rollouts of a batch against their hashes, and the first arm against a single environment."""
    known = json.loads(GOLDEN.read_text())
    for name, arguments in ROLLOUTS.items():
        found = rollout(arguments)
        if found != known[name]:
            raise AssertionError(f"the rollout with {name} must have the hash {known[name][:12]}, got {found[:12]}")
    env, batch = ElbowArmEnv(duration=1.0), ElbowArmVectorEnv(3, duration=1.0)
    env.reset(seed=0)
    batch.reset(seed=0)
    for action in np.random.default_rng(0).uniform(-1.0, 1.0, (50, 3, 10)):
        if (env.step(action[0])[0] != batch.step(action)[0][0]).any():
            raise AssertionError("an arm of a batch must be a single environment to the last bit, got another")
    return f"{len(ROLLOUTS)} to the last bit, a single arm as in a batch"


def accelerations(
    q: Array, q_dot: Array, current: Array, voltage: Array, elbows: tuple[int, ...]
) -> tuple[Array, Array]:
    """Accelerations [rad/s^2] and elbow forces [N] of the paper's arm in the fast form."""
    state = np.zeros((1, STATE_ROWS, len(q)))
    state[0, :3] = q, q_dot, current
    q_ddot, current_dot, force = np.zeros((1, len(q))), np.zeros((1, len(q))), np.zeros((1, len(elbows)))
    joints, rows = np.array(elbows, dtype=np.int64), parameter_table(paper_arm(), Conditions())[None]
    kernel(1).accelerations(state, rows, voltage[None].copy(), joints, q_ddot, current_dot, force)
    return q_ddot[0], force[0]


def check_close(what: str, found: Array, expected: Array) -> float:
    """The largest difference as a share of the largest expected entry. AssertionError beyond `SAME`."""
    error = float(np.abs(found - expected).max(initial=0.0) / max(1.0, float(np.abs(expected).max(initial=0.0))))
    if not error < SAME:
        raise AssertionError(f"{what} must agree to {SAME:g}, got {error:.3g}")
    return error


def printed_form() -> str:
    """Accelerations and elbow forces in the fast form against the paper's equations, in random states."""
    arm, rng, worst = paper_arm(), np.random.default_rng(1), 0.0
    for elbows in ((), (4,), (4, 7)):
        for _ in range(5):
            q = np.array(arm.nominal_pose) + 0.2 * rng.normal(size=10)
            q_dot, current = rng.normal(size=(2, 10))
            voltage = rng.uniform(-24.0, 24.0, 10)
            found = accelerations(q, q_dot, current, voltage, elbows)
            expected = forward_dynamics(arm, q, q_dot, current, voltage, elbows)
            for what, ours, theirs in zip(("accelerations", "elbow forces"), found, expected[:2], strict=True):
                worst = max(worst, check_close(f"{what} with elbows {elbows}", ours, theirs))
    return f"15 states, largest difference {worst:.1e} of the largest entry"


def static_forces() -> str:
    """Elbow forces of the arm at rest: torques chosen so that each elbow carries 3 N hold it still, by virtual work."""
    arm, elbows, wanted = paper_arm(), (4, 7), np.array([3.0, 3.0])
    q, zero = np.array(arm.nominal_pose), np.zeros(10)
    torque = bias_forces(arm, q, zero) - constraint_jacobian(arm, q, elbows).T @ wanted
    current = torque / arm.of_motors("joint_torque_constant")
    q_ddot, force = accelerations(q, zero, current, zero, elbows)
    check_close("accelerations at rest", q_ddot, zero)
    return f"3 N at each elbow to {check_close('elbow forces at rest', force, wanted):.1e}"


def gymnasium_checker() -> str:
    """Gymnasium's checker of environments, for every id with a scalar reward."""
    names = [name for name in ids() if not name.startswith("mo-")]
    for name in names:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            check_env(gym.make(name).unwrapped, skip_render_check=True)
    return ", ".join(names)


def stable_baselines_checker() -> str:
    """Stable-Baselines3's checker of environments, where it is installed."""
    if find_spec("stable_baselines3") is None:
        return "not installed, left out"
    from stable_baselines3.common.env_checker import check_env as check

    check(gym.make("ElbowArm-v0"))
    return "ElbowArm-v0"


def ids() -> list[str]:
    """Ids that this package registers, sorted."""
    return sorted(name for name, spec in gym.registry.items() if str(spec.entry_point).startswith("elbow_gym."))


CHECKS: dict[str, Callable[[], str]] = {
    "versions": versions,
    "compilation": compilation,
    "golden rollouts": golden_rollouts,
    "printed form": printed_form,
    "static elbow forces": static_forces,
    "Gymnasium's checker": gymnasium_checker,
    "Stable-Baselines3's checker": stable_baselines_checker,
}
"""Checks by name; each returns figures, or raises where something is wrong."""


def verify(checks: Mapping[str, Callable[[], str]] | None = None) -> bool:
    """Runs checks, `CHECKS` when None, and prints a line each; whether all have passed."""
    passed = True
    for name, check in (CHECKS if checks is None else checks).items():
        try:
            line = f"ok    {name}: {check()}"
        # Whatever goes wrong in one check is its result, and the others are still of use.
        except Exception as error:
            passed = False
            line = f"FAIL  {name}: {type(error).__name__}: {error}"
        print(line, flush=True)
    return passed

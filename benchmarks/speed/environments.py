"""Contenders that run through Gymnasium and Stable-Baselines3: env.step, vector environments, PPO, starting up."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import ExitStack, closing
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.speed.own import ENV_STEP, OURS, PAPER_CASE, Contender, Sampler, timed

GYMNASIUM, SB3 = "Gymnasium", "Stable-Baselines3"
FRAME, START = "PPO frame", "start"
ELBOW_ARM = "ElbowArm-v0"
MUJOCO_TASKS = ("HalfCheetah-v5", "Reacher-v5", "Pusher-v5")
VECTOR_ARMS, COPIES = 256, 8
JOINTS, ELBOWS = PAPER_CASE
CHECKOUT = Path(__file__).parents[2]


def _single(name: str, stack: ExitStack) -> Sampler:
    import gymnasium as gym

    import elbow_gym  # noqa: F401

    env = stack.enter_context(closing(gym.make(name)))
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(100)]
    env.reset(seed=0)

    def work() -> None:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    return timed(work, len(actions))


def _vector_env(name: str, mode: str, num_envs: int, threads: int) -> Any:
    import gymnasium as gym

    import elbow_gym  # noqa: F401

    own = {"num_threads": threads} if mode == "vector_entry_point" else {}
    return gym.make_vec(name, num_envs=num_envs, vectorization_mode=mode, **own)


def _vector(name: str, mode: str, num_envs: int, threads: int, stack: ExitStack) -> Sampler:
    from gymnasium.utils.performance import benchmark_vector_step

    env = stack.enter_context(closing(_vector_env(name, mode, num_envs, threads)))
    # Annotated as int, but only compared with a difference of times.
    return lambda seconds: 1.0 / benchmark_vector_step(env, target_duration=seconds, seed=0)  # type: ignore[arg-type]


def _vector_alone(num_envs: int, threads: int, clock: str, stack: ExitStack) -> Sampler:
    env = stack.enter_context(closing(_vector_env(ELBOW_ARM, "vector_entry_point", num_envs, threads)))
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(10)]
    env.reset(seed=0)
    return timed(lambda: [env.step(action) for action in actions], len(actions) * num_envs, clock)


def _ppo(num_envs: int, torch_threads: int, clock: str, n_steps: int) -> Sampler:
    import torch
    from stable_baselines3 import PPO

    from elbow_gym.sb3 import SB3VecEnv
    from elbow_gym.vector_env import ElbowArmVectorEnv

    env = SB3VecEnv(ElbowArmVectorEnv(num_envs, autoreset_mode="SameStep", num_threads=torch_threads))
    model = PPO(
        "MlpPolicy",
        env,
        n_steps=n_steps,
        batch_size=num_envs * n_steps // 4,
        n_epochs=4,
        policy_kwargs={"net_arch": [64, 64]},
        seed=0,
        device="cpu",
    )

    def work() -> None:
        torch.set_num_threads(torch_threads)
        model.learn(n_steps * num_envs, reset_num_timesteps=False)

    return timed(work, n_steps * num_envs, clock)


IMPORT = "import time; start = time.process_time(); import elbow_gym; print(time.process_time() - start)"
FIRST_STEP = """
import time
import gymnasium as gym, elbow_gym
start = time.process_time()
env = gym.make{}
env.reset(seed=0)
env.step(env.action_space.sample())
print(time.process_time() - start)
"""
SINGLE, VECTOR = f"('{ELBOW_ARM}')", f"_vec('{ELBOW_ARM}', num_envs={VECTOR_ARMS})"


def _in_fresh_process(script: str, cold: bool) -> Sampler:
    """A sampler of the CPU seconds that a script prints, run by a new interpreter; `cold` with an empty Numba cache."""

    def sample(_: float) -> float:
        with TemporaryDirectory() as folder:
            environment = os.environ | ({"NUMBA_CACHE_DIR": folder} if cold else {})
            run = [sys.executable, "-c", script]
            done = subprocess.run(run, cwd=CHECKOUT, env=environment, capture_output=True, text=True, check=True)
        return float(done.stdout.split()[-1])

    if not cold:
        sample(0.0)  # fills the caches of Numba and the system
    return sample


def environment_contenders(quick: bool = False) -> list[Contender]:
    """env.step of the single, the vectorised and Gymnasium's environments, PPO, import and first steps."""
    arm: dict[str, Any] = {"joints": JOINTS, "elbows": ELBOWS}
    found = [
        Contender(family=OURS, name=f"{ELBOW_ARM}, single", unit=ENV_STEP, make=lambda s: _single(ELBOW_ARM, s), **arm)
    ]
    for threads in (1, 2):
        how: dict[str, Any] = {"arms": VECTOR_ARMS, "threads": threads}
        clock = "cpu" if threads == 1 else "wall"
        benchmark = lambda s, t=threads: _vector(ELBOW_ARM, "vector_entry_point", VECTOR_ARMS, t, s)  # noqa: E731
        alone = lambda s, t=threads, c=clock: _vector_alone(VECTOR_ARMS, t, c, s)  # noqa: E731
        name = f"{ELBOW_ARM}, vector"
        found.append(
            Contender(family=OURS, name=name, unit=ENV_STEP, make=benchmark, clock="wall", seconds=0.3, **arm, **how)
        )
        name += ", without sampling actions"
        found.append(Contender(family=OURS, name=name, unit=ENV_STEP, make=alone, clock=clock, **arm, **how))
    for task in (ELBOW_ARM, MUJOCO_TASKS[0]):
        for mode in ("sync", "async"):
            found.append(
                Contender(
                    family=OURS if task == ELBOW_ARM else GYMNASIUM,
                    name=f"{task}, {mode.capitalize()}VectorEnv",
                    unit=ENV_STEP,
                    make=lambda s, t=task, m=mode: _vector(t, m, COPIES, 1, s),
                    arms=COPIES,
                    # One process per copy; how many run at once is up to the system.
                    threads=1 if mode == "sync" else COPIES,
                    clock="wall",
                    seconds=0.3,
                    **(arm if task == ELBOW_ARM else {}),
                )
            )
    found += [
        Contender(family=GYMNASIUM, name=f"{task}, single", unit=ENV_STEP, make=lambda s, t=task: _single(t, s))
        for task in MUJOCO_TASKS
    ]
    found += [
        Contender(
            family=SB3,
            name=f"{ELBOW_ARM}, 64x64 net",
            unit=FRAME,
            make=lambda _, t=threads, c=clock: _ppo(VECTOR_ARMS, t, c, 4 if quick else 64),
            arms=VECTOR_ARMS,
            threads=threads,
            clock=clock,
            rounds=3,
            seconds=3.0,
            **arm,
        )
        for threads, clock in ((1, "cpu"), (2, "wall"))
    ]
    starts = (
        ("import elbow_gym", IMPORT, False, 1.0),
        ("first step, single, from cache", FIRST_STEP.format(SINGLE), False, 2.0),
        ("first step, vector, from cache", FIRST_STEP.format(VECTOR), False, 2.0),
        ("first step, single, compiling", FIRST_STEP.format(SINGLE), True, 15.0),
        ("first step, vector, compiling", FIRST_STEP.format(VECTOR), True, 15.0),
    )
    found += [
        Contender(
            family=OURS,
            name=name,
            unit=START,
            make=lambda _, s=script, c=cold: _in_fresh_process(s, c),
            arms=VECTOR_ARMS if "vector" in name else 1,
            rounds=1 if cold else 5,
            seconds=seconds,
        )
        for name, script, cold, seconds in starts
    ]
    return found

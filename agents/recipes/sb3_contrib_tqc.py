"""sb3-contrib's TQC and CrossQ on the native batch.

Pinned: sb3-contrib 2.9.2, stable-baselines3 2.9.2, gymnasium 1.4.0, torch 2.13.0.
`python -m agents.recipes.sb3_contrib_tqc`, or with `--algorithm crossq`

As `sb3_ppo`: through `SB3VecEnv`, so "SameStep". A step of 32 arms is followed by 8 gradient steps; fewer for each
step, on more arms, learned worse in short runs. `log_std_init` is not given: these algorithms use it with `use_sde`
alone.
"""

from __future__ import annotations

from typing import Any, Literal

import torch
from sb3_contrib import TQC, CrossQ

from agents.recipes.race import AfterUpdate, main
from agents.recipes.sb3_ppo import Joules, environment

NUM_ENVS, GRADIENT_STEPS = 32, 8
FIRST_STEPS = 250 * NUM_ENVS
"""Control periods with random actions before the first gradient step: an episode of each arm."""
ALGORITHMS = {"tqc": TQC, "crossq": CrossQ}


def train(
    steps: int = 250_000,
    seed: int = 0,
    after_update: AfterUpdate = lambda *_: False,
    algorithm: Literal["tqc", "crossq"] = "tqc",
) -> Any:
    """Trains one of sb3-contrib's algorithms."""
    env = environment(NUM_ENVS, start_noise=0.1)
    env.seed(seed)
    model = ALGORITHMS[algorithm](
        "MlpPolicy",
        env,
        learning_rate=7e-4,
        buffer_size=200_000,
        learning_starts=FIRST_STEPS,
        batch_size=256,
        gamma=0.97,
        train_freq=1,
        gradient_steps=GRADIENT_STEPS,
        ent_coef="auto_0.01",
        target_entropy=-20.0,
        policy_kwargs={"net_arch": [64, 64], "activation_fn": torch.nn.SiLU},
        seed=seed,
        device="cpu",
    )
    return model.learn(steps, callback=Joules(after_update))


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(train, 250_000, tuple(ALGORITHMS))

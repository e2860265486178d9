"""Small training runs.

As a module, `python -m tests.support.trainings PPO_FOLDER SAC_FOLDER`, it starts two that are killed midway.
"""

import json
import os
import signal
import sys
from dataclasses import replace
from pathlib import Path

from agents.learning.callback import Keeper
from agents.learning.ppo.settings import PPOSettings
from agents.learning.run import Run
from agents.learning.sac.settings import SACSettings
from agents.learning.train import train
from elbow_gym.task.settings import Settings

SMALL = PPOSettings(
    total_timesteps=1024, num_envs=4, n_steps=64, batch_size=64, n_epochs=1, hidden=(8,), evaluate_every=256
)


def small_run(folder, **changes):
    environment = json.loads(json.dumps(Settings(duration=1.0).arguments))
    return Run(
        **{"algorithm": "ppo", "environment": environment, "settings": SMALL, "seed": 0, "folder": folder} | changes
    )


SAC_SMALL = SACSettings(
    total_timesteps=1240,
    num_envs=4,
    hidden=(8,),
    gradient_steps=1,
    batch_size=32,
    learning_starts=1200,
    buffer_size=4000,
    imitation_steps=50,
)
SAC_KILLED = {
    "algorithm": "sac",
    # The actor moves from early on, so that what it becomes rests on all that a checkpoint holds.
    "settings": replace(
        SAC_SMALL,
        total_timesteps=800,
        learning_starts=400,
        evaluate_every=200,
        critic_head_start=20,
        average_tau=0.1,
    ),
}


def die(keeper):
    """A callback that kills its own process after 600 steps."""
    if keeper.num_timesteps > 600:
        os.kill(os.getpid(), signal.SIGKILL)
    return True


def killed(run):
    """The exit code of a process of its own in which a run is killed midway."""
    process = os.fork()
    if process == 0:
        Keeper._on_step = die
        train(run)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


if __name__ == "__main__":
    ppo, sac = map(Path, sys.argv[1:])
    for run in (small_run(ppo, checkpoint_seconds=0.0), small_run(sac, checkpoint_seconds=0.0, **SAC_KILLED)):
        print(killed(run), flush=True)

"""Trainings killed at random moments and resumed: `python -m tests.support.kills KIND FOLDER KILLS SEED LATEST`.

Four of five kills come after the first control period of a start, the others before, at most LATEST seconds after it.
Each line on stdout is the time of a kill [s], after that period or after the start, and the checkpoint that it left;
the last is "finished".
"""

import os
import random
import signal
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from agents.learning.callback import Keeper
from agents.learning.train import train
from agents.workers import compile_before
from elbow_gym.task.settings import Settings
from tests.support.trainings import SAC_KILLED, SMALL, small_run

LONG = {
    "ppo": {"settings": replace(SMALL, total_timesteps=20_480, evaluate_every=2048)},
    "sac": {
        **SAC_KILLED,
        "settings": replace(SAC_KILLED["settings"], total_timesteps=2400, evaluate_every=400),
    },
}
"""Trainings of several seconds, by kind."""


def long_run(kind, folder):
    """A run of `LONG` with a checkpoint twenty times a second, into a folder."""
    return small_run(folder, checkpoint_seconds=0.05, **LONG[kind])


FILLER = "filler"
"""File that takes all that is left of a disk."""


def fill(place):
    """Fills the disk that a folder is on."""
    with suppress(OSError), (place / FILLER).open("ab", buffering=0) as file:
        while True:
            file.write(bytes(4096))


def resumed(run):
    """A process of its own that trains on, and a pipe in which a byte comes with its first control period."""
    seen, tell = os.pipe()
    process = os.fork()
    if process == 0:
        code, on_step = 1, Keeper._on_step

        def step(keeper):
            Keeper._on_step = on_step
            os.write(tell, b"1")
            return on_step(keeper)

        Keeper._on_step = step
        try:
            code = 0 if train(run, resume=True)["finished"] else 2
        finally:
            sys.stdout.flush()
            os._exit(code)
    os.close(tell)
    return process, seen


def main(kind, folder, kills, seed, latest):
    """Kills a run a number of times at random moments, and has it end after that."""
    run, draw = long_run(kind, Path(folder)), random.Random(int(seed))
    settings = Settings(**run.environment)
    # Children inherit the kernels, so that their time goes into training.
    compile_before([(settings, run.settings.num_envs), settings])
    for _ in range(int(kills)):
        process, seen = resumed(run)
        moment, place = draw.uniform(0.0, float(latest)), "after the start"
        if draw.random() < 0.8:
            place = "of training"
            os.read(seen, 1)
        time.sleep(moment)
        os.close(seen)
        os.kill(process, signal.SIGKILL)
        code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        left = max((path.name for path in Path(folder).glob("checkpoint_*")), default="no checkpoint")
        print(
            f"killed {moment:.2f} s {place}: {left}" if code == -signal.SIGKILL else f"ended by itself: {code}",
            flush=True,
        )
    print("finished" if os.waitpid(resumed(run)[0], 0)[1] == 0 else "failed", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])

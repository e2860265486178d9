"""Work for jobs that can be sent to any worker."""

import os
import signal
import time

import numpy as np

from agents.jobs.job import unwanted
from agents.jobs.processes import ONE_THREAD


def surroundings(_):
    """Threads that linear algebra may take, signals that are blocked, and the process."""
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    return [os.environ[name] for name in ONE_THREAD], sorted(blocked), os.getpid()


def begin(size, tell):
    """Tells of all its work at once, and returns it."""
    tell(size)
    return size


def fail(tell):
    """Fails after a unit of work."""
    tell(1)
    raise ValueError("wrong")


def stopped(_):
    """Ends as what nobody waits for."""
    raise InterruptedError("another run failed or was interrupted")


def die(_):
    """Ends its process as a lack of memory does."""
    os.kill(os.getpid(), signal.SIGKILL)


def leave(_):
    """Ends its process as a script does that starts itself again in each of its workers."""
    os._exit(3)


def die_once(path, tell):
    """Ends its process, unless it has done so before, in the middle of four units of work."""
    tell(2, "half is done")
    if not path.exists():
        path.write_text("")
        die(tell)
    tell(2)
    return os.getpid()


def wait_until_unwanted(path, tell):
    """Says with a file that it waits, and goes on until nobody wants it to."""
    path.with_suffix(".begun").write_text("")
    while not unwanted():
        time.sleep(0.05)
    path.write_text("")
    tell(1)


def double(array, _):
    """Doubles an array in place, of any size."""
    array *= 2.0
    return array


def made_by_id(_):
    """Return of a control period in an environment that Gymnasium finds by its package's name."""
    import gymnasium as gym

    env = gym.make("elbow_gym:ElbowArm-v0")
    env.reset(seed=0)
    return float(env.step(np.zeros(10, dtype=np.float32))[1])


def first_step(_):
    """CPU time of the first control period of a batch, with the compilation of its kernel where there is none [s]."""
    from elbow_gym.vector_env import ElbowArmVectorEnv

    begun = time.process_time()
    env = ElbowArmVectorEnv(16)
    env.reset(seed=0)
    env.step(np.zeros((16, 10), dtype=np.float32))
    return time.process_time() - begun

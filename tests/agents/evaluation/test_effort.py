"""Time of a decision: the controller's own, of one arm."""

import time

import numpy as np

from agents.evaluation.effort import decision_time
from agents.evaluation.player import player_of
from elbow_gym.task.settings import Settings


class Slow:
    def __init__(self, env):
        self.arms = env.num_envs

    def predict(self, observation, **_):
        assert observation.shape == (1, 41)
        before = time.thread_time()
        while time.thread_time() - before < 0.002:
            pass
        time.sleep(0.001)
        return np.zeros((self.arms, 10)), None


def test_decision_takes_the_controllers_cpu_time_and_not_the_time_that_it_waits():
    player = player_of("slow", Settings(duration=0.5), Slow)
    assert 0.002 <= decision_time(player) < 0.0029

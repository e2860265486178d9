"""Script of a user of the wheel, which runs and passes a strict type checker: the PD and a policy play an episode."""

from typing import Any

import gymnasium as gym

from elbow_gym import Conditions, Interface, PDController, Simulator, load_policy, paper_arm


def play(env: gym.Env[Any, Any], controller: PDController | Any) -> None:
    observation, info = env.reset(seed=0)
    truncated = False
    while not truncated:
        observation, _, _, truncated, info = env.step(controller.predict(observation)[0])
    print(info["tracking_error"], info["electrical_energy"])


fast, slow = gym.make("ElbowArm-v0", elbows=2, control_frequency=2000.0), gym.make("ElbowArm-v0", elbows=2)
policy = load_policy("ppo", elbows=2)
policy.check(slow)
play(fast, PDController(fast))
play(slow, policy)
simulator = Simulator(paper_arm(), 2, conditions=Conditions(payload=0.1))
simulator.step(-0.1 * Interface(slow).decode(slow.reset(seed=0)[0])["joint_velocity"])
print(simulator.elbow_force.min(), Interface(slow).control_period)

"""Proximal policy optimisation in one file, in CleanRL's form, on the native batch under Gymnasium 1.x.

Pinned: gymnasium 1.4.0, torch 2.13.0.
`python -m agents.recipes.cleanrl_ppo`

CleanRL's own scripts are written for Gymnasium 0.29, whose batches reset in the step that ends an episode. Gymnasium
1.x does so only with `autoreset_mode="SameStep"`; in its default mode "NextStep" the step after an end ignores its
action, and a script that learns from it learns from a step that nobody took. Episodes of this task only end by
truncation, so that the value of the last observation, `info["final_obs"]`, has to be added: CleanRL's script drops it,
as if the arm died.
"""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

from agents.recipes.networks import perceptron
from agents.recipes.race import AfterUpdate, main

NUM_ENVS, PERIODS = 64, 250
"""Arms, and control periods of each between two updates: one episode, so that an update sees all parts of it."""
GAMMA, LAMBDA, CLIP, EPOCHS, BATCH, RATE = 0.97, 0.95, 0.2, 8, 1000, 1e-3


class Agent(nn.Module):
    """Actor and critic, with a standard deviation of the actions that does not depend on the state."""

    def __init__(self, observation: int, action: int) -> None:
        super().__init__()
        self.mean, self.critic = perceptron(observation, action), perceptron(observation, 1)
        self.log_std = nn.Parameter(torch.full((action,), -1.5))

    def forward(self, observation: torch.Tensor) -> Normal:
        """Distribution of the actions (..., n)."""
        return Normal(self.mean(observation), self.log_std.exp())

    def value(self, observation: torch.Tensor) -> torch.Tensor:
        """Value of the observations (...)."""
        return self.critic(observation).squeeze(-1)

    def act(self, observation: np.ndarray) -> np.ndarray:
        """Mean actions (..., n)."""
        with torch.no_grad():
            return self.mean(torch.from_numpy(observation)).numpy()


def train(steps: int = 1_000_000, seed: int = 0, after_update: AfterUpdate = lambda *_: False) -> Agent:
    """Trains by proximal policy optimisation in CleanRL's form."""
    torch.manual_seed(seed)
    env = gym.make_vec("elbow_gym:ElbowArm-v0", NUM_ENVS, autoreset_mode="SameStep", start_noise=0.1)
    size, n = env.single_observation_space.shape[0], env.single_action_space.shape[0]
    agent = Agent(size, n)
    optimizer = torch.optim.Adam(agent.parameters(), lr=RATE, eps=1e-5, fused=True)
    observations, actions = torch.zeros(PERIODS, NUM_ENVS, size), torch.zeros(PERIODS, NUM_ENVS, n)
    log_probs, rewards, values, lasting = torch.zeros(4, PERIODS, NUM_ENVS)
    observation = torch.from_numpy(env.reset(seed=seed)[0])
    updates = -(-steps // (PERIODS * NUM_ENVS))
    for update in range(updates):
        optimizer.param_groups[0]["lr"] = RATE * max(1.0 - update / updates, 0.05)
        with torch.no_grad():
            for t in range(PERIODS):
                policy = agent(observation)
                observations[t], actions[t] = observation, policy.sample()
                log_probs[t], values[t] = policy.log_prob(actions[t]).sum(-1), agent.value(observation)
                after, reward, terminated, truncated, info = env.step(actions[t].numpy())
                if truncated.any():
                    last = torch.from_numpy(np.stack(info["final_obs"][truncated]))
                    reward[truncated] += GAMMA * agent.value(last).numpy()
                rewards[t], lasting[t] = torch.from_numpy(reward), torch.from_numpy(~(terminated | truncated))
                observation = torch.from_numpy(after)
            advantages = estimate(rewards, torch.cat([values, agent.value(observation)[None]]), lasting)
        samples = (observations, actions, log_probs, advantages, advantages + values)
        learn(agent, optimizer, [array.flatten(0, 1) for array in samples])
        if after_update((update + 1) * PERIODS * NUM_ENVS, agent.act):
            break
    env.close()
    return agent


def estimate(rewards: torch.Tensor, values: torch.Tensor, lasting: torch.Tensor) -> torch.Tensor:
    """Generalised advantage estimates (T, B) from rewards (T, B), values (T + 1, B) and 0 where an episode ended."""
    advantages, advantage = torch.zeros_like(rewards), torch.zeros(rewards.shape[1])
    for t in reversed(range(len(rewards))):
        delta = rewards[t] + GAMMA * lasting[t] * values[t + 1] - values[t]
        advantages[t] = advantage = delta + GAMMA * LAMBDA * lasting[t] * advantage
    return advantages


def learn(agent: Agent, optimizer: torch.optim.Optimizer, samples: list[torch.Tensor]) -> None:
    """Some epochs of gradient steps on the clipped objective and the value's squared error."""
    for _ in range(EPOCHS):
        for rows in torch.randperm(len(samples[0])).split(BATCH):
            observation, action, log_prob, advantage, aim = (array[rows] for array in samples)
            ratio = (agent(observation).log_prob(action).sum(-1) - log_prob).exp()
            advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
            gain = torch.minimum(ratio * advantage, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * advantage).mean()
            loss = 0.5 * (agent.value(observation) - aim).square().mean() - gain
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(train, 1_000_000)

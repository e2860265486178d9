"""TorchRL's PPO on the native batch.

Pinned: torchrl 0.14.1, tensordict 0.14.3, gymnasium 1.4.0, torch 2.13.0.
`python -m agents.recipes.torchrl_ppo`

Unmodified. `autoreset_mode` must be "SameStep" or "Disabled": the default "NextStep" is refused. Advantages take the
value of the last observation where an episode is truncated. Stay with them: the n-step targets of `MultiStep` add the
value of the state where an episode has *terminated*, too.
"""

from __future__ import annotations

import gymnasium as gym
import torch
from tensordict.nn import AddStateIndependentNormalScale, TensorDictModule
from torch import nn
from torch.distributions import Independent, Normal
from torchrl.collectors import Collector
from torchrl.envs import GymWrapper
from torchrl.modules import ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

from agents.recipes.networks import perceptron
from agents.recipes.race import AfterUpdate, main

NUM_ENVS, PERIODS = 64, 250
"""Arms, and control periods of each between two updates: one episode, so that an update sees all parts of it."""
FRAMES, EPOCHS, BATCH, RATE = NUM_ENVS * PERIODS, 8, 1000, 1e-3


def train(steps: int = 1_000_000, seed: int = 0, after_update: AfterUpdate = lambda *_: False) -> nn.Module:
    """Trains TorchRL's PPO."""
    torch.manual_seed(seed)
    env = GymWrapper(gym.make_vec("elbow_gym:ElbowArm-v0", NUM_ENVS, autoreset_mode="SameStep", start_noise=0.1))
    env.set_seed(seed)
    size, n = env.observation_spec["observation"].shape[-1], env.action_spec.shape[-1]
    mean = perceptron(size, n)
    scaled = nn.Sequential(mean, AddStateIndependentNormalScale(n, scale_mapping="exp", scale_lb=1e-3))
    nn.init.constant_(scaled[1].state_independent_scale, -1.5)
    actor = ProbabilisticActor(
        TensorDictModule(scaled, in_keys=["observation"], out_keys=["loc", "scale"]),
        in_keys=["loc", "scale"],
        distribution_class=lambda loc, scale: Independent(Normal(loc, scale), 1),
        return_log_prob=True,
    )
    critic = ValueOperator(perceptron(size, 1), in_keys=["observation"])
    advantage = GAE(gamma=0.97, lmbda=0.95, value_network=critic)
    loss = ClipPPOLoss(actor, critic, clip_epsilon=0.2, entropy_bonus=False, critic_coeff=0.5, loss_critic_type="l2")
    loss.normalize_advantage = True
    optimizer = torch.optim.Adam(loss.parameters(), lr=RATE, eps=1e-5, fused=True)
    updates = -(-steps // FRAMES)
    collector = Collector(env, actor, frames_per_batch=FRAMES, total_frames=updates * FRAMES)
    for update, data in enumerate(collector, start=1):
        with torch.no_grad():
            samples = advantage(data).flatten()
        for _ in range(EPOCHS):
            for rows in torch.randperm(FRAMES).split(BATCH):
                values = loss(samples[rows])
                optimizer.zero_grad()
                (values["loss_objective"] + values["loss_critic"]).backward()
                nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimizer.step()
        if after_update(update * FRAMES, lambda seen: mean(torch.from_numpy(seen)).detach().numpy()):
            break
    collector.shutdown()
    return mean


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(train, 1_000_000)

"""RLlib's PPO, new API stack, on the native batch.

Pinned: ray[rllib] 2.60.0, gymnasium 1.2.2 (which RLlib demands), torch 2.13.0.
`python -m agents.recipes.rllib_ppo`, with `--runners 4` in four processes beside the learner's, and with
`--address auto` on the cluster that `ray_cluster.yaml` starts.

Unmodified, with `gym_env_vectorize_mode="vector_entry_point"`. Leave `autoreset_mode` at its default, "NextStep":
RLlib takes the observation after an episode's end for the next episode's first. Given "SameStep" it takes the new
episode's first observation for the old one's last, and the second for the first, so that every episode loses its first
step.

The module differs from RLlib's default one in its start alone: actions near zero with a standard deviation of 0.22 of
the supply voltage, not of all of it.
"""

from __future__ import annotations

from typing import Any

import ray
import torch
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.algorithms.ppo.torch.default_ppo_torch_rl_module import DefaultPPOTorchRLModule
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.rllib.core.rl_module.rl_module import RLModuleSpec
from torch import nn

from agents.recipes.race import AfterUpdate, main

NUM_ENVS, PERIODS = 64, 250
"""Arms, and control periods of each between two updates: one episode, so that an update sees all parts of it."""
FRAMES = NUM_ENVS * PERIODS


class QuietModule(DefaultPPOTorchRLModule):
    """RLlib's default module that begins with small actions and a small standard deviation."""

    def setup(self) -> None:
        """Builds the networks."""
        super().setup()
        nn.init.constant_(self.pi.log_std, -1.5)
        last = [layer for layer in self.pi.modules() if isinstance(layer, nn.Linear)][-1]
        nn.init.orthogonal_(last.weight, 0.01)
        nn.init.zeros_(last.bias)


def train(
    steps: int = 1_000_000,
    seed: int = 0,
    after_update: AfterUpdate = lambda *_: False,
    runners: int = 0,
    address: str = "local",
) -> Any:
    """Trains RLlib's PPO.

    Args:
        steps: length of the training [control periods], summed over all arms.
        seed: seed of the environment and the networks.
        after_update: called after each update.
        runners: processes that step a native batch each, `NUM_ENVS` arms together; the learner's own when 0. An update
            sees as many control periods either way, of other random numbers.
        address: cluster of Ray; one with a CPU for each runner is started here when "local".
    """
    if NUM_ENVS % max(runners, 1):
        raise ValueError(f"runners must divide {NUM_ENVS}, got {runners}")
    mine = {"num_cpus": 1 + runners, "include_dashboard": False} if address == "local" else {}
    ray.init(address, **mine, log_to_driver=False, ignore_reinit_error=True)
    config = (
        PPOConfig()
        .environment("elbow_gym:ElbowArm-v0", env_config={"start_noise": 0.1})
        .env_runners(
            num_env_runners=runners,
            num_envs_per_env_runner=NUM_ENVS // max(runners, 1),
            gym_env_vectorize_mode="vector_entry_point",
            rollout_fragment_length=PERIODS,
        )
        .learners(num_learners=0)
        .rl_module(
            rl_module_spec=RLModuleSpec(
                QuietModule,
                model_config=DefaultModelConfig(
                    fcnet_hiddens=[64, 64],
                    fcnet_activation="silu",
                    free_log_std=True,
                    vf_share_layers=False,
                ),
            )
        )
        .training(
            gamma=0.97,
            lr=1e-3,
            train_batch_size_per_learner=FRAMES,
            minibatch_size=1000,
            num_epochs=8,
            lambda_=0.95,
            clip_param=0.2,
            use_kl_loss=False,
            vf_loss_coeff=0.5,
            vf_clip_param=float("inf"),
            grad_clip=0.5,
        )
        .debugging(seed=seed, log_level="ERROR")
    )
    algorithm = config.build_algo()

    def actor(observation: Any) -> Any:
        with torch.no_grad():
            outputs = algorithm.get_module().forward_inference({Columns.OBS: torch.from_numpy(observation)})
        return outputs[Columns.ACTION_DIST_INPUTS][:, :10].numpy()

    for done in range(FRAMES, steps + FRAMES, FRAMES):
        algorithm.train()
        if after_update(done, actor):
            break
    algorithm.stop()
    ray.shutdown()
    return algorithm


if __name__ == "__main__":
    torch.set_num_threads(1)
    main(train, 1_000_000, options={"runners": 0, "address": "local"})

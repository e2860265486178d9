#!/usr/bin/env bash
# Package: skrl 2.1.1 (with gymnasium 1.4.0, torch 2.13.0).
# Expected: PPO's returns of an episode end where it is truncated, with the value of its last observation added; no
#   reward of the next episode is in them.
# Seen: by default, `time_limit_bootstrap=False`, the advantages run on over a truncation into the arm's next episode
#   as if the two were one; only a termination cuts them. With `time_limit_bootstrap=True` they are cut, and a value
#   is added: in a Gymnasium batch with `autoreset_mode="SameStep"` it is the value of the next episode's first
#   observation, since the trainer reads the step's observation and not `infos["final_obs"]`.
# Why it matters: in a task that only truncates, which is the rule for control, each episode's last steps are charged
#   for what the next one begins with, and the setting that is there to mend it charges for it, too.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
  skrl==2.1.1 gymnasium==1.4.0 torch==2.13.0 numpy
"$folder/venv/bin/python" - <<'PYTHON'
import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.trainers.torch import SequentialTrainer


class Counter(gym.Env):
    """Observes 10, 11, 12, is truncated there, and rewards the first step of an episode alone, with 100."""

    observation_space = gym.spaces.Box(0.0, 20.0, (1,))
    action_space = gym.spaces.Box(-1.0, 1.0, (1,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        return np.array([10.0], dtype=np.float32), {}

    def step(self, action):
        self.steps += 1
        reward = 100.0 if self.steps == 1 else 0.0
        return np.array([10.0 + self.steps], dtype=np.float32), reward, False, self.steps == 2, {}


class Policy(GaussianMixin, Model):
    def __init__(self, **spaces):
        Model.__init__(self, **spaces)
        GaussianMixin.__init__(self)
        self.mean = torch.nn.Parameter(torch.zeros(1))

    def compute(self, inputs, role):
        return self.mean + 0.0 * inputs["observations"], {"log_std": torch.zeros(1)}


class Value(DeterministicMixin, Model):
    """A thousandth of the observation, so that a value tells whose it is."""

    def __init__(self, **spaces):
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.scale = torch.nn.Parameter(torch.tensor(1e-3))

    def compute(self, inputs, role):
        return self.scale * inputs["observations"], {}


def stored(bootstrap):
    """Rewards and returns of the first arm over two episodes of two steps."""
    env = wrap_env(SyncVectorEnv([Counter, Counter], autoreset_mode=AutoresetMode.SAME_STEP))
    spaces = {"observation_space": env.observation_space, "action_space": env.action_space}
    models = {"policy": Policy(**spaces), "value": Value(**spaces)}
    memory = RandomMemory(memory_size=4, num_envs=2)
    cfg = PPO_CFG(
        rollouts=4, discount_factor=1.0, gae_lambda=1.0, learning_rate=0.0, time_limit_bootstrap=bootstrap
    )
    cfg.experiment.write_interval = cfg.experiment.checkpoint_interval = 0
    agent = PPO(models=models, memory=memory, cfg=cfg, **spaces)
    trainer = SequentialTrainer(
        env=env,
        agents=agent,
        cfg={"timesteps": 4, "headless": True, "disable_progressbar": True, "close_environment_at_exit": False},
    )
    trainer.train()
    return [memory.get_tensor_by_name(name)[:, 0, 0].tolist() for name in ("rewards", "returns")]


rewards, returns = stored(bootstrap=False)
print("default: returns", np.round(returns, 3))
# The first episode earns 100; its return holds the second's 100 as well, and its last step, which earns 0, has 100.
assert np.allclose(returns[:2], [200.0, 100.0], atol=0.1)
rewards, returns = stored(bootstrap=True)
print("time_limit_bootstrap: rewards", np.round(rewards, 3), "returns", np.round(returns, 3))
added = rewards[1]
print(f"value added at the truncation: {added:.4f}")
# The last observation is 12, of value 0.012; 10 is the first of the next episode, of value 0.010.
assert abs(added - 0.010) < 1e-4
assert np.allclose(returns[:2], [100.0, 0.0], atol=0.1)
PYTHON

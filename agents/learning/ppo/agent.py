"""Stable-Baselines3's PPO with fewer operations beside the arms' and the networks' own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import stable_baselines3
import torch
from stable_baselines3.common.utils import explained_variance

from agents.learning.actor import actor_layers
from agents.learning.flat_adam import FlatAdam
from agents.learning.ppo.layers import Layers
from agents.learning.ppo.loss import Batch, Spread, log_prob, surrogate


class PPO(stable_baselines3.PPO):
    """Stable-Baselines3's PPO for continuous actions, whose time goes into arms and networks.

    The algorithm, its settings and what it saves are the parent's. The gradients are written down instead of recorded,
    the noise of a rollout is drawn at once, the values of its observations are computed at once after it, and its
    samples go to the networks in the order in which they were stored, shuffled once a pass. State-dependent noise and
    other optimizers than `FlatAdam` are left to the parent.

    Takes the arguments of `stable_baselines3.PPO`; a limit on the values' change (`clip_range_vf`) is not among them.
    """

    policy: Any
    rollout_buffer: Any

    @property
    def _written_down(self) -> bool:
        return isinstance(self.policy.optimizer, FlatAdam) and not self.use_sde

    def collect_rollouts(self, env: Any, callback: Any, rollout_buffer: Any, n_rollout_steps: int) -> bool:
        """Fills the buffer with control periods of all arms; False where the callback ended the training.

        Args:
            env: the `VecEnv`.
            callback: callback of the training.
            rollout_buffer: buffer of `n_rollout_steps` control periods of each arm.
            n_rollout_steps: number of control periods.
        """
        if not self._written_down:
            return super().collect_rollouts(env, callback, rollout_buffer, n_rollout_steps)
        buffer = rollout_buffer
        self.policy.set_training_mode(False)
        buffer.reset()
        callback.on_rollout_start()
        ended: list[tuple[int, int]] = []
        last: list[Any] = []
        with torch.no_grad():
            (actor, critic), log_std = self._networks(), self.policy.log_std
            departure = torch.randn(buffer.actions.shape)
            noise = log_std.exp() * departure
            buffer.log_probs[:] = log_prob(departure, Spread.of(log_std))
            for k in range(n_rollout_steps):
                buffer.observations[k], buffer.episode_starts[k] = self._last_obs, self._last_episode_starts
                action = actor.forward(torch.from_numpy(self._last_obs)).add_(noise[k]).numpy()
                buffer.actions[k] = action
                clipped = np.clip(action, self.action_space.low, self.action_space.high)
                self._last_obs, buffer.rewards[k], dones, infos = env.step(clipped)
                self._last_episode_starts = dones
                self.num_timesteps += env.num_envs
                callback.update_locals(locals())
                if not callback.on_step():
                    return False
                over = np.flatnonzero(dones)
                self._update_info_buffer([infos[i] for i in over])
                for i in over:
                    if infos[i].get("TimeLimit.truncated", False):
                        ended.append((k, i))
                        last.append(infos[i]["terminal_observation"])
            buffer.pos, buffer.full = n_rollout_steps, True
            seen = torch.from_numpy(buffer.observations).flatten(0, 1)
            values = [critic.forward(part) for part in seen.split(self.batch_size)]
            buffer.values[:] = torch.cat(values).view(buffer.values.shape)
            if ended:
                # The episode would have gone on.
                after = critic.forward(torch.from_numpy(np.array(last)))
                buffer.rewards[tuple(np.transpose(ended))] += self.gamma * after.numpy().ravel()
            following = critic.forward(torch.from_numpy(self._last_obs))
        buffer.compute_returns_and_advantage(last_values=following, dones=dones)
        callback.update_locals(locals())
        callback.on_rollout_end()
        return True

    def train(self) -> None:
        """Makes the gradient steps of an update from the rollout buffer."""
        if not self._written_down:
            super().train()
            return
        policy = self.policy
        policy.set_training_mode(True)
        self._update_learning_rate(policy.optimizer)
        clip_range = self.clip_range(self._current_progress_remaining)
        actor, critic = self._networks()
        optimizer, log_std = policy.optimizer, policy.log_std
        optimizer.zero_grad()
        figures: list[tuple[float, ...]] = []
        diverged = False
        with torch.no_grad():
            spread = Spread.of(log_std)
            for epoch in range(self.n_epochs):
                for batch in self._batches():
                    descent = surrogate(actor.forward(batch.observation), spread, batch, clip_range)
                    actor.backward(descent.mean)
                    if log_std.requires_grad:
                        torch.sub(descent.log_std, self.ent_coef, out=log_std.grad)
                    # After the actor: the cache holds one network's values, not two.
                    excess = critic.forward(batch.observation).sub_(batch.returns.unsqueeze(-1))
                    critic.backward(excess * (2.0 * self.vf_coef / len(excess)))
                    if epoch == self.n_epochs - 1 or self.target_kl is not None:
                        figures.append((*descent.figures(clip_range), excess.square().mean().item()))
                        diverged = self.target_kl is not None and figures[-1][2] > 1.5 * self.target_kl
                        if diverged:
                            break
                    optimizer.clip(self.max_grad_norm)
                    optimizer.step()
                    if log_std.requires_grad:
                        spread = Spread.of(log_std)
                self._n_updates += 1
                if diverged:
                    break
        self._log(figures, clip_range)

    def _networks(self) -> tuple[Layers, Layers]:
        """Actor, whose outputs are the means of the actions, and critic."""
        critic = [*self.policy.mlp_extractor.value_net, self.policy.value_net]
        return Layers(actor_layers(self)), Layers(critic)

    def _batches(self) -> Iterator[Batch]:
        """The samples of the rollout buffer in batches, in random order."""
        buffer = self.rollout_buffer
        names = ("observations", "actions", "log_probs", "advantages", "returns")
        parts = [torch.from_numpy(getattr(buffer, name)).flatten(0, 1) for name in names]
        order = torch.randperm(len(parts[0]))
        for drawn in zip(*(part.index_select(0, order).split(self.batch_size) for part in parts), strict=True):
            batch = Batch(*drawn)
            if self.normalize_advantage and len(batch.advantage) > 1:
                std, mean = torch.std_mean(batch.advantage)
                batch.advantage.sub_(mean).div_(std + 1e-8)
            yield batch

    def _log(self, figures: Sequence[tuple[float, ...]], clip_range: float) -> None:
        """Records the entries of Stable-Baselines3's PPO, means over the last pass."""
        log_std, buffer = self.policy.log_std.detach(), self.rollout_buffer
        names = ("policy_gradient_loss", "clip_fraction", "approx_kl", "value_loss")
        means = dict(zip(names, np.mean(figures, axis=0), strict=True))
        means["entropy_loss"] = -float((log_std + 0.5 * np.log(2.0 * np.pi * np.e)).sum())
        means["loss"] = (
            means["policy_gradient_loss"] + self.ent_coef * means["entropy_loss"] + self.vf_coef * means["value_loss"]
        )
        means["explained_variance"] = explained_variance(buffer.values.ravel(), buffer.returns.ravel())
        means.update(std=log_std.exp().mean().item(), clip_range=clip_range)
        for name, value in means.items():
            self.logger.record(f"train/{name}", value)
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")

"""Stable-Baselines3's PPO with compiled networks and their gradient in closed form."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np
import stable_baselines3
import torch
from gymnasium.spaces import Box
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import FlattenExtractor
from stable_baselines3.common.utils import explained_variance

from agents.learning.actor import actor_layers
from agents.learning.flat_adam import FlatAdam
from agents.learning.layers import compilable, kind_of, outputs, places_of
from agents.learning.passes import Array, Integers, room_for
from agents.learning.ppo.gradient import Loss, Networks, Samples, gradient_of


class PPO(stable_baselines3.PPO):
    """Stable-Baselines3's PPO for continuous actions, whose time goes into arms and networks.

    The algorithm, its settings and what it saves are the parent's. The networks and the loss are compiled, with the
    gradient written down instead of recorded; the noise of a rollout is drawn at once, and the values of its
    observations are computed at once after it. Everything that this does not cover is left to the parent: other
    optimizers than `FlatAdam`, policies than `MlpPolicy` with one of four activations, spaces than one row of numbers,
    state-dependent noise, layers that do not learn, and a limit on the values' change.

    Takes the arguments of `stable_baselines3.PPO`. Learn inside `one_thread`: that is fastest, and the number of BLAS's
    threads changes the bits.
    """

    policy: Any
    rollout_buffer: Any

    @property
    def _covered(self) -> bool:
        policy = self.policy
        if self.use_sde or self.clip_range_vf is not None or type(policy) is not ActorCriticPolicy:
            return False
        plain = isinstance(policy.optimizer, FlatAdam) and type(policy.features_extractor) is FlattenExtractor
        spaces = isinstance(self.action_space, Box) and len(self.observation_space.shape or ()) == 1
        return plain and spaces and compilable(self._layers)

    @property
    def _layers(self) -> list[Any]:
        """Layers of the actor and then of the critic."""
        return [*actor_layers(self), *self.policy.mlp_extractor.value_net, self.policy.value_net]

    def collect_rollouts(self, env: Any, callback: Any, rollout_buffer: Any, n_rollout_steps: int) -> bool:
        """Fills the buffer with control periods of all arms; False where the callback ended the training.

        Args:
            env: the `VecEnv`.
            callback: callback of the training.
            rollout_buffer: buffer of `n_rollout_steps` control periods of each arm.
            n_rollout_steps: number of control periods.
        """
        if not self._covered:
            return super().collect_rollouts(env, callback, rollout_buffer, n_rollout_steps)
        buffer = rollout_buffer
        self.policy.set_training_mode(False)
        buffer.reset()
        callback.on_rollout_start()
        ended: list[tuple[int, int]] = []
        last: list[Any] = []
        networks, parameters = self._networks(), self.policy.optimizer.values.numpy()
        given = {"parameters": parameters, "kind": networks.kind, "room": room_for(networks.actor, networks.critic)}
        actor, critic = (partial(outputs, places=one, **given) for one in (networks.actor, networks.critic))
        log_std = self.policy.log_std.detach().numpy()
        departure = torch.randn(buffer.actions.shape).numpy()
        noise = np.exp(log_std) * departure
        constant = log_std.sum() + 0.5 * np.log(2.0 * np.pi) * len(log_std)
        buffer.log_probs[:] = -0.5 * np.square(departure).sum(-1) - constant
        for k in range(n_rollout_steps):
            buffer.observations[k], buffer.episode_starts[k] = self._last_obs, self._last_episode_starts
            action = actor(self._last_obs) + noise[k]
            buffer.actions[k] = action
            clipped = np.clip(action, self.action_space.low, self.action_space.high)
            self._last_obs, buffer.rewards[k], dones, infos = env.step(clipped)
            self._last_episode_starts = dones
            self.num_timesteps += env.num_envs
            callback.update_locals(locals())
            if not callback.on_step():
                return False
            over = np.flatnonzero(dones)
            self._update_info_buffer([infos[i] for i in over], np.ones(len(over), dtype=bool))
            for i in over:
                if infos[i].get("TimeLimit.truncated", False):
                    ended.append((k, i))
                    last.append(infos[i]["terminal_observation"])
        buffer.pos, buffer.full = n_rollout_steps, True
        buffer.values[:] = critic(buffer.observations.reshape(buffer.values.size, -1)).reshape(buffer.values.shape)
        if ended:
            # The episode would have gone on.
            buffer.rewards[tuple(np.transpose(ended))] += self.gamma * critic(np.array(last)).ravel()
        following = torch.from_numpy(critic(self._last_obs))
        buffer.compute_returns_and_advantage(last_values=following, dones=dones)
        callback.update_locals(locals())
        callback.on_rollout_end()
        return True

    def train(self) -> None:
        """Makes the gradient steps of an update from the rollout buffer."""
        if not self._covered:
            super().train()
            return
        policy = self.policy
        policy.set_training_mode(True)
        self._update_learning_rate(policy.optimizer)
        clip_range = self.clip_range(self._current_progress_remaining)
        networks, optimizer = self._networks(), policy.optimizer
        optimizer.zero_grad()
        samples, loss = self._samples(), Loss(clip_range, self.vf_coef, self.normalize_advantage)
        room = room_for(networks.actor, networks.critic)
        parameters, gradient = optimizer.values.numpy(), optimizer.gradient.numpy()
        figures: list[Array] = []
        diverged = False
        for epoch in range(self.n_epochs):
            figures.clear()
            for batch in self._batches():
                means = np.empty(4)
                gradient_of(batch, samples, parameters, networks, loss, room, gradient, means)
                if policy.log_std.requires_grad:
                    policy.log_std.grad.sub_(self.ent_coef)
                else:
                    policy.log_std.grad.zero_()
                if epoch == self.n_epochs - 1 or self.target_kl is not None:
                    figures.append(means)
                    diverged = self.target_kl is not None and means[2] > 1.5 * self.target_kl
                    if diverged:
                        break
                optimizer.clip(self.max_grad_norm)
                optimizer.step()
            self._n_updates += 1
            if diverged:
                break
        self._log(figures, clip_range)

    def _networks(self) -> Networks:
        """Where actor, whose outputs are the means of the actions, critic and deviations lie in the parameters."""
        policy, place = self.policy, self.policy.optimizer.place
        both, actor = self._layers, actor_layers(self)
        critic = both[len(actor) :]
        return Networks(places_of(actor, place), places_of(critic, place), kind_of(both), place(policy.log_std))

    def _samples(self) -> Samples:
        """The rollout buffer, arm after arm of each control period."""
        buffer = self.rollout_buffer
        arrays = (getattr(buffer, name) for name in ("observations", "actions", "log_probs", "advantages", "returns"))
        return Samples(*(array.reshape(-1, *array.shape[2:]) for array in arrays))

    def _batches(self) -> Iterator[Integers]:
        """Numbers of the rollout's samples in random order, in batches."""
        order = torch.randperm(self.rollout_buffer.values.size)
        return (part.numpy() for part in order.split(self.batch_size))

    def _log(self, figures: Sequence[Array], clip_range: float) -> None:
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

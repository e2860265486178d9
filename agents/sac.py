"""Stable-Baselines3's SAC with Huber's loss for the critics."""

from __future__ import annotations

from typing import Any

import numpy as np
import stable_baselines3
import torch
from torch.nn import functional


class SAC(stable_baselines3.SAC):
    """Soft actor-critic whose critics' squared loss becomes linear past `huber_delta`.

    A metre of tracking error outweighs a millimetre a million times in a squared loss, and the values of an arm that
    has arrived then drown in what is left of the errors on its way there.

    Args:
        huber_delta: temporal-difference error from which on the loss is linear, in units of the return; the loss is
            squared throughout when None.
        arguments: those of `stable_baselines3.SAC`.
    """

    def __init__(self, *positional: Any, huber_delta: float | None = None, **arguments: Any) -> None:
        super().__init__(*positional, **arguments)
        self.huber_delta = huber_delta

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """As in Stable-Baselines3 but for the loss; the critics' weights take no gradients from the actor's loss."""
        self.policy.set_training_mode(True)
        optimizers = [self.actor.optimizer, self.critic.optimizer]
        if self.ent_coef_optimizer is not None:
            optimizers.append(self.ent_coef_optimizer)
        self._update_learning_rate(optimizers)
        critic_losses, actor_losses, ent_coefs = [], [], []
        for _ in range(gradient_steps):
            # As in Stable-Baselines3: without a VecNormalize this hands out what was stored.
            data: Any = self.replay_buffer.sample(batch_size, env=self._vec_normalize_env)  # pyright: ignore[reportOptionalMemberAccess]
            if self.use_sde:
                self.actor.reset_noise()
            ent_coef = self.ent_coef_tensor if self.log_ent_coef is None else self.log_ent_coef.detach().exp()
            action, log_prob = self.actor.action_log_prob(data.observations)
            log_prob = log_prob.reshape(-1, 1)
            self._price_entropy(log_prob.detach())
            critic_losses.append(self._fit_critics(data, ent_coef))
            actor_losses.append(self._improve_actor(data, action, ent_coef * log_prob))
            ent_coefs.append(float(ent_coef))
            with torch.no_grad():
                for target, current in zip(self.critic_target.parameters(), self.critic.parameters(), strict=True):
                    target.lerp_(current, self.tau)
        self._n_updates += gradient_steps
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        self.logger.record("train/ent_coef", np.mean(ent_coefs))
        self.logger.record("train/actor_loss", np.mean(actor_losses))
        self.logger.record("train/critic_loss", np.mean(critic_losses))

    def _price_entropy(self, log_prob: torch.Tensor) -> None:
        if self.ent_coef_optimizer is None or self.log_ent_coef is None:
            return
        loss = -(self.log_ent_coef * (log_prob + float(self.target_entropy))).mean()
        self.ent_coef_optimizer.zero_grad()
        loss.backward()
        self.ent_coef_optimizer.step()

    def _fit_critics(self, data: Any, ent_coef: torch.Tensor) -> float:
        with torch.no_grad():
            action, log_prob = self.actor.action_log_prob(data.next_observations)
            after = torch.cat(self.critic_target(data.next_observations, action), dim=1).amin(dim=1, keepdim=True)
            after = after - ent_coef * log_prob.reshape(-1, 1)
            discount = self.gamma if data.discounts is None else data.discounts
            target = data.rewards + (1.0 - data.dones) * discount * after
        values = self.critic(data.observations, data.actions)
        loss = torch.stack([self._loss(value, target) for value in values]).sum()
        self.critic.optimizer.zero_grad()
        loss.backward()
        self.critic.optimizer.step()
        return float(loss.detach())

    def _loss(self, value: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
        if self.huber_delta is None:
            return 0.5 * functional.mse_loss(value, target)
        return functional.huber_loss(value, target, delta=self.huber_delta)

    def _improve_actor(self, data: Any, action: torch.Tensor, cost: torch.Tensor) -> float:
        self.critic.requires_grad_(False)
        value = torch.cat(self.critic(data.observations, action), dim=1).amin(dim=1, keepdim=True)
        loss = (cost - value).mean()
        self.actor.optimizer.zero_grad()
        loss.backward()
        self.actor.optimizer.step()
        self.critic.requires_grad_(True)
        return float(loss.detach())

"""Stable-Baselines3's SAC with critics that are quadratic around a slow copy of the actor."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from typing import Any, ClassVar, NamedTuple

import numpy as np
import stable_baselines3
import torch
from gymnasium import spaces
from stable_baselines3.sac.policies import SACPolicy
from torch import Tensor
from torch.nn import functional

from agents.learning.sac.critic import QuadraticCritics
from agents.learning.sac.inputs import Foresight, Sharpened


class CentredPolicy(SACPolicy):
    """Actor, twin `QuadraticCritics` and their targets, and two copies of the actor's mean that follow it.

    The nearer copy is the centre of the critics' quadratic form. The farther one is an average of the last actors,
    which does not follow the critics' every turn; deterministic predictions are its actions.

    Args:
        positional: positional arguments of Stable-Baselines3's `SACPolicy`.
        view: inputs of the critics from the observation; the observation alone when None.
        arguments: further arguments of `SACPolicy`.
    """

    def __init__(self, *positional: Any, view: Sharpened | Foresight | None = None, **arguments: Any) -> None:
        self.view = view
        super().__init__(*positional, **arguments)

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        layers = [*self.actor.latent_pi, self.actor.mu]
        self.center = torch.nn.Sequential(*copy.deepcopy(layers), torch.nn.Tanh()).requires_grad_(False)
        self.average = copy.deepcopy(self.center)

    def make_critic(self, features_extractor: Any = None) -> Any:
        """Twin critics that are quadratic in the action. `features_extractor` is not used."""
        del features_extractor
        hidden: Any = self.critic_kwargs["net_arch"]
        size, joints = (spaces.flatdim(space) for space in (self.observation_space, self.action_space))
        return QuadraticCritics(self.view or Sharpened(size), joints, hidden).to(self.device)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), "view": self.view}

    def _predict(self, observation: Any, deterministic: bool = False) -> Tensor:
        return self.average(observation) if deterministic else self.actor(observation)

    def follow(self, center: float, average: float) -> None:
        """Moves the two copies towards the actor's mean.

        Args:
            center: share of the way that the centre goes [-], in [0, 1].
            average: share of the way that the average goes [-], in [0, 1].
        """
        ahead = [parameter for layer in (self.actor.latent_pi, self.actor.mu) for parameter in layer.parameters()]
        _approach(self.center.parameters(), ahead, center)
        _approach(self.average.parameters(), ahead, average)


class Batch(NamedTuple):
    """B transitions of an arm with n joints, from the replay buffer."""

    observation: Tensor
    """Observations before the action [-], shape (B, size)."""
    action: Tensor
    """Actions in units of the actor's output [-], in [-1, 1], shape (B, n)."""
    reward: Tensor
    """Rewards of the action [return], shape (B,)."""
    discount: Tensor
    """Discount factors of the next state's value [-], 0 where the episode terminated, shape (B,)."""
    after: Tensor
    """Observations after the action [-], shape (B, size)."""


class SAC(stable_baselines3.SAC):
    """Soft actor-critic whose critics are quadratic in the action, around a slow copy of the actor's mean.

    Two voltages that are a volt apart have values that differ by less than the error of a critic of general form, which
    does not tell them apart. A critic that is quadratic in the action fits one slope to all actions that were tried in
    a state, and the actor climbs that slope no further than the curvature lets it.

    In a squared loss a metre of tracking error weighs a million times more than a millimetre, so that errors on the way
    to the circle hide the values of an arm that has arrived; past `huber_delta` the loss is linear.

    Args:
        positional: positional arguments of `stable_baselines3.SAC`.
        huber_delta: temporal-difference error past which the critics' loss is linear [return]; squared throughout
            when None.
        actor_rate: learning rate of the actor as a multiple of the critics' [-].
        center_tau: share of the way to the actor that the centre goes in each gradient step [-].
        average_tau: share of the way to the actor that the average goes in each gradient step [-].
        critic_head_start: number of gradient steps of the critics before the actor's first.
        proximity: weight of half the squared distance between the actor's mean and the centre, in the actor's loss
            [return]. It is a curvature that holds the actor back where the critics have none.
        arguments: further arguments of `stable_baselines3.SAC`.
    """

    policy_aliases: ClassVar = {"MlpPolicy": CentredPolicy}
    policy: Any

    def __init__(
        self,
        *positional: Any,
        huber_delta: float | None = None,
        actor_rate: float = 0.2,
        center_tau: float = 0.002,
        average_tau: float = 0.0005,
        critic_head_start: int = 0,
        proximity: float = 0.0,
        **arguments: Any,
    ) -> None:
        self.huber_delta, self.actor_rate = huber_delta, actor_rate
        self.center_tau, self.average_tau = center_tau, average_tau
        self.critic_head_start, self.proximity = critic_head_start, proximity
        super().__init__(*positional, **arguments)

    def _setup_learn(self, *positional: Any, **arguments: Any) -> Any:
        if self._n_updates == 0:
            # The actor may have been given other weights since it was built.
            self.policy.follow(1.0, 1.0)
        return super()._setup_learn(*positional, **arguments)

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Makes gradient steps of the critics, the weight of the entropy, the actor and all copies that follow.

        Args:
            gradient_steps: number of gradient steps.
            batch_size: number of samples in each of them.
        """
        self.policy.set_training_mode(True)
        optimizers = [self.actor.optimizer, self.critic.optimizer]
        if self.ent_coef_optimizer is not None:
            optimizers.append(self.ent_coef_optimizer)
        self._update_learning_rate(optimizers)
        for group in self.actor.optimizer.param_groups:
            group["lr"] *= self.actor_rate
        losses = [self._step(batch) for batch in self._batches(gradient_steps, batch_size)]
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        self.logger.record("train/ent_coef", float(self._ent_coef()))
        for name, loss in zip(("critic_loss", "actor_loss"), np.mean(losses, axis=0), strict=True):
            self.logger.record(f"train/{name}", loss)

    def _batches(self, count: int, size: int) -> list[Batch]:
        """`count` batches of `size` transitions, drawn at once: a draw costs as much as a forward pass."""
        # As in Stable-Baselines3: without a VecNormalize this hands out what was stored.
        data: Any = self.replay_buffer.sample(count * size, env=self._vec_normalize_env)  # pyright: ignore[reportOptionalMemberAccess]
        discount = (1.0 - data.dones) * (self.gamma if data.discounts is None else data.discounts)
        whole = (data.observations, data.actions, data.rewards.ravel(), discount.ravel(), data.next_observations)
        return [Batch(*parts) for parts in zip(*(part.split(size) for part in whole), strict=True)]

    def _step(self, batch: Batch) -> tuple[float, float]:
        """Makes one gradient step and returns the losses of the critics and the actor."""
        learning = self._n_updates >= self.critic_head_start
        self.policy.follow(self.center_tau, self.average_tau)
        ent_coef, center = self._ent_coef(), self.policy.center(batch.observation)
        quadratic: Any = self.critic(batch.observation)
        values, target = quadratic(batch.action - center), self._target(batch, ent_coef)
        critic_loss = torch.stack([self._loss(value, target) for value in values]).sum()
        _descend(self.critic.optimizer, critic_loss)
        actor_loss = torch.zeros(())
        if learning:
            if self.use_sde:
                self.actor.reset_noise()
            action, log_prob = self.actor.action_log_prob(batch.observation)
            self._price_entropy(log_prob.detach())
            # The critics' weights take no gradients from the actor's loss.
            actor_loss = (ent_coef * log_prob - quadratic.detach()(action - center).amin(0)).mean()
            if self.proximity > 0.0:
                mean = torch.tanh(self.actor.action_dist.distribution.mean)
                actor_loss = actor_loss + 0.5 * self.proximity * (mean - center).square().sum(-1).mean()
            _descend(self.actor.optimizer, actor_loss)
        _approach(self.critic_target.parameters(), self.critic.parameters(), self.tau)
        self._n_updates += 1
        return float(critic_loss.detach()), float(actor_loss.detach())

    def _target(self, batch: Batch, ent_coef: Tensor) -> Tensor:
        """Values that the critics should have had [return], shape (B,)."""
        with torch.no_grad():
            action, log_prob = self.actor.action_log_prob(batch.after)
            quadratic: Any = self.critic_target(batch.after)
            after = quadratic(action - self.policy.center(batch.after)).amin(0) - ent_coef * log_prob
            return batch.reward + batch.discount * after

    def _loss(self, value: Tensor, target: Tensor) -> Tensor:
        """Mean loss of values (B,) against their targets (B,)."""
        if self.huber_delta is None:
            return 0.5 * functional.mse_loss(value, target)
        return functional.huber_loss(value, target, delta=self.huber_delta)

    def _ent_coef(self) -> Tensor:
        """Weight of the entropy [return/nat]."""
        return self.ent_coef_tensor if self.log_ent_coef is None else self.log_ent_coef.detach().exp()

    def _price_entropy(self, log_prob: Tensor) -> None:
        """Makes a gradient step of the weight of the entropy, from log-probabilities of actions (B,)."""
        if self.ent_coef_optimizer is not None and self.log_ent_coef is not None:
            loss = -(self.log_ent_coef * (log_prob + float(self.target_entropy))).mean()
            _descend(self.ent_coef_optimizer, loss)


def _descend(optimizer: torch.optim.Optimizer, loss: Tensor) -> None:
    optimizer.zero_grad()
    loss.backward()
    optimizer.step()


def _approach(behind: Iterable[Tensor], ahead: Iterable[Tensor], share: float) -> None:
    """Moves tensors by a share of their ways to others of the same shapes."""
    with torch.no_grad():
        for one, other in zip(behind, ahead, strict=True):
            one.lerp_(other, share)

"""The recipe of sb3-contrib: both algorithms make gradient steps on the batch, and the policy is an average's."""

import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

from agents.recipes import sb3_contrib_tqc as recipe

# The observations' inputs `Foresight` are slices of 41 entries.
OBSERVATION = np.full((3, 41), 0.1, dtype=np.float32)


def short_training(algorithm, monkeypatch):
    """Model after one round of gradient steps, and what its actors did after each step of all arms."""
    monkeypatch.setattr(recipe, "NUM_ENVS", 32)
    monkeypatch.setattr(recipe, "FIRST_STEPS", 64)
    seen = []

    def after_update(steps, actor):
        seen.append((steps, actor(OBSERVATION)))
        return steps >= 96

    return recipe.train(1000, after_update=after_update, algorithm=algorithm), seen


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["tqc", "crossq"])
def test_gradient_steps_follow_the_steps_of_all_arms(algorithm, monkeypatch):
    model, seen = short_training(algorithm, monkeypatch)
    assert [steps for steps, _ in seen] == [32, 64, 96]
    assert seen[-1][1].shape == (3, 10)
    assert model._n_updates == recipe.GRADIENT_STEPS


@pytest.mark.slow
def test_policy_is_an_average_whose_actions_are_shares_of_the_full_supply(monkeypatch):
    model, seen = short_training("tqc", monkeypatch)
    first, averaged = (actions * 24.0 / recipe.VOLTAGE_LIMIT for _, actions in (seen[0], seen[-1]))
    last = model.predict(OBSERVATION, deterministic=True)[0]
    # The average goes a five-hundredth of the way, four of two thousand gradient steps, on which a network bends.
    np.testing.assert_allclose(averaged - first, (last - first) / 500.0, atol=0.3 * np.abs(last - first).max() / 500.0)
    assert np.abs(last - first).max() > 1e-4

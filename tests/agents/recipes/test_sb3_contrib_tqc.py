"""The recipe of sb3-contrib: both algorithms make gradient steps on the batch."""

import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

from agents.recipes import sb3_contrib_tqc


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", ["tqc", "crossq"])
def test_gradient_steps_follow_the_steps_of_all_arms(algorithm, monkeypatch):
    monkeypatch.setattr(sb3_contrib_tqc, "FIRST_STEPS", 64)
    seen = []

    def after_update(steps, actor):
        seen.append((steps, actor(np.zeros((3, 41), dtype=np.float32)).shape))
        return steps >= 96

    model = sb3_contrib_tqc.train(1000, after_update=after_update, algorithm=algorithm)
    assert seen[-1] == (96, (3, 10))
    assert model._n_updates == sb3_contrib_tqc.GRADIENT_STEPS

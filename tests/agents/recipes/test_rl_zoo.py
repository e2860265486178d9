"""The hyperparameter files of RL Zoo, in its own command."""

import sys
from pathlib import Path

import pytest

pytest.importorskip("rl_zoo3")

from rl_zoo3.train import train

RECIPES = Path(__file__).parents[3] / "agents" / "recipes"
# Warnings of the library are not this project's.
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]


@pytest.mark.parametrize(
    ("algorithm", "file", "steps"),
    [("ppo", "rl_zoo_ppo", 4000), ("sac", "rl_zoo_sac", 500), ("tqc", "rl_zoo_sac", 500)],
)
def test_command_trains_and_saves(algorithm, file, steps, tmp_path, monkeypatch):
    command = f"train --algo {algorithm} --env ElbowArm-v0 --gym-packages elbow_gym --conf-file {RECIPES / file}.yml"
    more = f" -n {steps} --eval-freq -1 -f {tmp_path}"
    more += "" if algorithm == "ppo" else " -params learning_starts:400"
    monkeypatch.setattr(sys, "argv", (command + more).split())
    train()
    assert list(tmp_path.glob(f"{algorithm}/*/ElbowArm-v0.zip"))

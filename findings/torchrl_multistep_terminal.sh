#!/usr/bin/env bash
# Package: torchrl 0.14.1 (with tensordict 0.14.3, torch 2.13.0).
# Expected: an n-step target stops at a terminal state: where the window of a sample reaches one, the target is the
#   sum of the rewards on the way, and no value is added.
# Seen: `MultiStep` moves the next observation to the terminal state, but leaves the sample's own "terminated" flag
#   where it was, False. Every loss and estimator reads that flag, so the value of the terminal state is added to the
#   targets of the n - 1 steps before the end; only the last step's target is right. The "nonterminal" entry that
#   `MultiStep` writes says True for them, too. `DQNLoss` below sees it: three rewards of 1, and 0.729 times the 100
#   that the network says of a state which is over. `MultiStepTransform`, its form for replay buffers, uses the same
#   function.
# Why it matters: with n steps every episode that really ends teaches that its end is worth something: a falling
#   robot's last n - 1 steps get the network's guess of the fallen state instead of nothing.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
  torchrl==0.14.1 tensordict==0.14.3 torch==2.13.0 numpy
"$folder/venv/bin/python" - <<'PYTHON'
import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from torchrl.data import Categorical
from torchrl.data.postprocs import MultiStep
from torchrl.modules import QValueActor
from torchrl.objectives import DQNLoss

# One episode of four steps with a reward of 1 each; the last step reaches state 4, which is terminal.
steps = torch.arange(4.0)[None, :, None]
end = torch.tensor([False, False, False, True])[None, :, None]
after = TensorDict({"observation": steps + 1.0, "reward": torch.ones(1, 4, 1), "done": end, "terminated": end}, [1, 4])
episode = TensorDict({"observation": steps, "action": torch.zeros(1, 4, dtype=torch.int64), "next": after}, [1, 4])
moved = MultiStep(gamma=0.9, n_steps=3)(episode)[0]
print("next observation:", moved["next", "observation"].flatten().tolist())
print("terminated:      ", moved["next", "terminated"].flatten().tolist())
assert moved["next", "observation"].flatten().tolist() == [3.0, 4.0, 4.0, 4.0]
assert moved["next", "terminated"].flatten().tolist() == [False, False, False, True]


class Hundred(torch.nn.Module):
    """A network that values the terminal state at 100 and all others at 0."""

    def __init__(self):
        super().__init__()
        self.unused = torch.nn.Parameter(torch.zeros(1))

    def forward(self, observation):
        return 100.0 * (observation == 4.0).expand(*observation.shape[:-1], 2) + 0.0 * self.unused


actor = QValueActor(Hundred(), in_keys=["observation"], spec=Categorical(2), action_space="categorical")
loss = DQNLoss(actor, action_space="categorical", delay_value=False, loss_function="l1")
loss.make_value_estimator(gamma=0.9)
second = loss(moved[1:2].clone())["loss"].item()
print(f"target of the second step: {second:.3f}; rewards alone: {1 + 0.9 + 0.81:.3f}")
assert abs(second - (2.71 + 0.729 * 100.0)) < 1e-3
last = loss(moved[3:4].clone())["loss"].item()
print(f"target of the last step: {last:.3f}")
assert abs(last - 1.0) < 1e-3
PYTHON

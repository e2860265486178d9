"""Folders of the policies, optimal trajectories, learning curves and receipts that the repository carries.

- `policies/`: ALGORITHM[_LABEL]_TASK_seedK.safetensors and .json, every training seed but the best of each algorithm
  and task, which is the baseline in `elbow_gym/baselines/policies`. `python -m agents publish` writes both.
- `optima/`: trajectories that `python -m benchmarks optimal` found, .npz, and how they were found, .json.
- `curves/`: evaluations of each policy's training, ALGORITHM[_LABEL]_TASK_seedK.csv.
- `receipts/`: joules of the benchmark's episodes under the PD, which `python -m agents verify` plays again. Where the
  physics or the settings change on purpose: `python -m agents evaluate pd --elbows 2 --receipt > pd_elbows2.json`.
"""

from __future__ import annotations

from pathlib import Path

POLICIES = Path(__file__).parent / "policies"
OPTIMA = Path(__file__).parent / "optima"
CURVES = Path(__file__).parent / "curves"
RECEIPTS = Path(__file__).parent / "receipts"

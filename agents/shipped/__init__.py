"""What the repository carries of trainings: in `policies/` those of every training seed, as safetensors and JSON.

ALGORITHM[_LABEL]_TASK_seedK; the best seed of each algorithm and task is the baseline, in
`elbow_gym/baselines/policies`. `python -m agents publish` writes both.
"""

from __future__ import annotations

from pathlib import Path

POLICIES = Path(__file__).parent / "policies"

"""Compiled loops of the learning: their forms on disk, and the threads under them."""

import importlib.util
import os
import subprocess
import sys

import pytest

pytest.importorskip("torch")

CALLEE = "from agents.learning.compiled import compiled\n\n@compiled\ndef part(x):\n    return x + {}\n"
CALLER = (
    "from agents.learning.compiled import entry\nfrom callee import part\n\n@entry\ndef whole(x):\n    return part(x)\n"
)


def test_an_edit_of_a_callee_in_another_file_is_noticed(tmp_path, monkeypatch):
    (tmp_path / "caller.py").write_text(CALLER)
    found = []
    for more in (1.0, 2.0):
        (tmp_path / "callee.py").write_text(CALLEE.format(more))
        for name in ("callee", "caller"):
            spec = importlib.util.spec_from_file_location(name, tmp_path / f"{name}.py")
            module = importlib.util.module_from_spec(spec)
            monkeypatch.setitem(sys.modules, name, module)
            # Not from Python's own cache, which goes by seconds.
            exec(compile((tmp_path / f"{name}.py").read_text(), str(tmp_path / f"{name}.py"), "exec"), module.__dict__)
        found.append(sys.modules["caller"].whole(1.0))
    assert found == [2.0, 3.0]


THREADS = """
import numpy as np
import torch
from threadpoolctl import threadpool_info

from agents.learning.fit import Fit
from agents.learning.threads import one_thread

def threads():
    return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]

torch.set_num_threads(2)
known = threads()
with one_thread():
    before = threads()
    Fit([torch.nn.Linear(2, 1)]).step(np.arange(4), np.ones((4, 2), np.float32), np.ones((4, 1), np.float32), 0.1)
    print(torch.get_num_threads(), *sorted({*before, *threads()}), len(threads()) - len(before))
print(torch.get_num_threads(), threads()[: len(known)] == known)
"""


def test_training_takes_one_thread_of_torch_and_of_every_blas():
    """Also of SciPy's, whose products compiled code takes, and which nothing has loaded before."""
    two = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "2")
    shown = subprocess.run(
        [sys.executable, "-c", THREADS], env={**os.environ, **two}, check=True, capture_output=True, text=True
    )
    assert shown.stdout.split("\n")[:2] == ["1 1 0", "2 True"]

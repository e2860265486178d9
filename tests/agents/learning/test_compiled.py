"""Compiled loops of the learning: their forms on disk, and the threads under them."""

import importlib.util
import sys

import pytest

pytest.importorskip("torch")

from threadpoolctl import threadpool_info, threadpool_limits

from agents.learning.threads import one_thread

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


def test_training_takes_one_thread_of_torch_and_of_every_blas():
    import torch

    def threads():
        return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]

    before = torch.get_num_threads()
    with threadpool_limits(2, user_api="blas"):
        torch.set_num_threads(2)
        try:
            with one_thread():
                assert threads()
                assert {torch.get_num_threads(), *threads()} == {1}
            assert torch.get_num_threads() == 2
        finally:
            torch.set_num_threads(before)

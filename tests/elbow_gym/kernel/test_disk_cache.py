"""Numba's cache on disk: damaged files, a full disk, and processes that start together."""

import importlib.util
import os
import signal
import subprocess
import sys

import pytest

from elbow_gym.kernel import disk_cache
from elbow_gym.kernel.disk_cache import held
from elbow_gym.kernel.template import compiled

SOURCE = """
def doubled(x):
    return x + x
"""
WORKER = """
import sys
sys.path.insert(0, sys.argv[1])
import small
from elbow_gym.kernel.template import compiled
entry = compiled(small.doubled, cached=True)
assert entry(4) == 8
print(sum(entry.stats.cache_misses.values()))
"""

pytestmark = pytest.mark.skipif(not hasattr(compiled(lambda x: x), "py_func"), reason="nothing is compiled")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    # The cache lies beside the source, wherever the user has it.
    monkeypatch.setattr("numba.config.CACHE_DIR", "")
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    (tmp_path / "small.py").write_text(SOURCE)
    return tmp_path


def misses(folder):
    """Compilations of a first call, as a process makes it that has just started."""
    spec = importlib.util.spec_from_file_location("small", folder / "small.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    entry = compiled(module.doubled, cached=True)
    assert entry(4) == 8
    return sum(entry.stats.cache_misses.values())


def stored(folder, ending):
    (found,) = (folder / "__pycache__").glob(f"*{ending}")
    return found


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", ["empty", "cut", "flipped", "other"])
def test_a_damaged_file_is_told_and_made_anew(folder, capsys, ending, damage):
    assert (misses(folder), misses(folder)) == (1, 0)
    path = stored(folder, ending)
    data = path.read_bytes()
    middle = len(data) // 2
    flipped = data[:middle] + bytes([data[middle] ^ 1]) + data[middle + 1 :]
    path.write_bytes({"empty": b"", "cut": data[:middle], "flipped": flipped, "other": b"some text"}[damage])
    assert (misses(folder), misses(folder)) == (1, 0)
    assert capsys.readouterr().err.count("elbow_gym: a file of its cache is damaged and is made anew") == 1


def test_a_disk_that_takes_nothing_is_told_and_the_call_is_made(folder, capsys, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(disk_cache.CheckedFiles, "_save_data", full)
    assert misses(folder) == 1
    assert "elbow_gym: what it compiled could not be stored" in capsys.readouterr().err
    monkeypatch.undo()
    assert (misses(folder), misses(folder)) == (1, 0)


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_killed_process_frees_its_lock(tmp_path):
    path = tmp_path / "lock"
    ready, told = os.pipe()
    child = os.fork()
    if child == 0:
        with held(path):
            os.write(told, b".")
            signal.pause()
    os.read(ready, 1)
    with path.open("ab") as file, pytest.raises(BlockingIOError):
        disk_cache.fcntl.flock(file, disk_cache.fcntl.LOCK_EX | disk_cache.fcntl.LOCK_NB)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    with held(path), path.open("ab") as file, pytest.raises(BlockingIOError):
        disk_cache.fcntl.flock(file, disk_cache.fcntl.LOCK_EX | disk_cache.fcntl.LOCK_NB)


@pytest.mark.slow
def test_of_processes_that_start_together_one_compiles(folder):
    words = [sys.executable, "-c", WORKER, str(folder)]
    workers = [subprocess.Popen(words, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    assert sorted(int(worker.communicate(timeout=300)[0]) for worker in workers) == [0, 1]

"""Signals that end a program: a line a seed, the shell's exit code, and no worker that outlives it."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
TRAIN = [
    "train",
    "ppo",
    "--seeds",
    "2",
    "--num-envs",
    "8",
    "--n-steps",
    "64",
    "--batch-size",
    "256",
    "--output",
    "runs",
]
PATIENCE = 120.0
"""Longest wait for what should take a few seconds, on a machine that is busy [s]."""


def children(process):
    path = Path(f"/proc/{process.pid}/task/{process.pid}/children")
    return [int(child) for child in path.read_text().split()]


def alive(pid):
    stat = Path(f"/proc/{pid}/stat")
    return stat.exists() and stat.read_text().rpartition(")")[2].split()[0] != "Z"


def until(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)


def started(words, folder):
    """A program in a process group of its own, in which Ctrl-C is not ignored."""
    command = [sys.executable, "-m", "agents", *words]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "env": environment, "cwd": folder}
    restore = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return subprocess.Popen(command, start_new_session=True, **pipes)
    finally:
        signal.signal(signal.SIGINT, restore)


def ended(process, number, send):
    """Exit code, both outputs and the time taken, once every worker has gone."""
    workers = children(process)
    assert len(workers) >= 2
    sent = time.monotonic()
    send(process.pid, number)
    out, err = process.communicate(timeout=PATIENCE)
    until(lambda: not any(alive(worker) for worker in workers))
    print(f"{signal.Signals(number).name}: {time.monotonic() - sent:.1f} s")
    return process.returncode, out, err


@pytest.mark.soak
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="finds workers in /proc")
@pytest.mark.parametrize(
    ("number", "send"),
    [(signal.SIGINT, os.killpg), (signal.SIGTERM, os.kill), (signal.SIGHUP, os.kill)],
    ids=["INT-to-all", "TERM", "HUP"],
)
def test_signal_ends_all_seeds_with_a_line_each(tmp_path, number, send):
    process = started(TRAIN, tmp_path)
    bests = [tmp_path / "runs" / f"ppo_elbows2_seed{seed}" / "best.json" for seed in (0, 1)]
    until(lambda: process.poll() is not None or all(best.exists() for best in bests))
    code, out, err = ended(process, number, send)
    assert code == 128 + number
    for seed, line in enumerate(out.splitlines()[-2:]):
        assert line.startswith(f"ppo_elbows2_seed{seed}: not finished after "), out
    assert "Traceback" not in err


@pytest.mark.soak
@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="finds workers in /proc")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_report_leaves_no_workers_computing(tmp_path, number):
    process = started(["report"], tmp_path)
    until(lambda: process.poll() is not None or len(children(process)) >= 3)
    time.sleep(3.0)
    code, _, err = ended(process, number, os.kill)
    assert code == (143 if number == signal.SIGTERM else -number)
    assert "Traceback" not in err
    assert not (tmp_path / "report.html").exists()

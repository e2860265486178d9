"""Trainings whose workers are killed in the middle, and the one who gave them out: resumed, with nothing lost."""

import os
import random
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from elbow_gym.baselines.policy import read_policy

ROOT = Path(__file__).parents[3]
OPTIONS = (
    "--num-envs 4 --n-steps 64 --batch-size 64 --n-epochs 1 --hidden 8 --total-timesteps 40960 --evaluate-every 4096"
)
TRAIN = ["-m", "agents", "train", "ppo", "--seeds", "2", *OPTIONS.split(), "--checkpoint-seconds", "0.05"]
NAMES = ["ppo_elbows2_seed0", "ppo_elbows2_seed1"]
MACHINES = {"processes": ["--workers", "2"], "ray": ["--workers", "2", "--ray"]}
WORKERS = {"processes": "multiprocessing.spawn import spawn_main", "ray": "ray::_do"}
"""Part of the command line of a process that does a job."""
KILLS = 10
PATIENCE = 240.0
"""Longest wait for what should take a minute, on a machine that is busy [s]."""

pytestmark = [
    pytest.mark.soak,
    pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="finds workers in /proc"),
    pytest.mark.parametrize(
        "kind",
        ["processes", pytest.param("ray", marks=pytest.mark.skipif(not find_spec("ray"), reason="Ray is missing"))],
    ),
]


def started(folder, kind, *more):
    """A training in a session of its own, in which Ctrl-C is not ignored."""
    command = [
        sys.executable,
        *TRAIN,
        "--environment",
        '{"duration": 1.0}',
        "--output",
        str(folder),
        *MACHINES[kind],
        *more,
    ]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, "env": environment, "cwd": ROOT}
    restore = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return subprocess.Popen(command, start_new_session=True, **pipes)
    finally:
        signal.signal(signal.SIGINT, restore)


def descendants(pid):
    """Processes that a process has started, and those that these have."""
    found = []
    for task in Path(f"/proc/{pid}/task").glob("*"):
        # A process may end meanwhile.
        with suppress(OSError):
            found += [int(child) for child in (task / "children").read_text().split()]
    return found + [one for child in found for one in descendants(child)]


def workers(process, kind):
    """Processes that do jobs."""
    found = []
    for pid in descendants(process.pid):
        try:
            line = Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:
            continue
        if WORKERS[kind] in line:
            found.append(pid)
    return found


def until(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def latest(folder):
    """Control periods of the last checkpoint, 0 without one."""
    return max((int(path.name.rpartition("_")[2]) for path in folder.glob("checkpoint_*")), default=0)


def farthest(folder):
    return max(latest(folder / name) for name in NAMES)


def steps_of(out, name):
    return [int(steps.replace(",", "")) for steps in re.findall(rf"^{name}: +([\d,]+) steps", out, re.MULTILINE)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Weights of the trainings that nobody disturbs."""
    folder = tmp_path_factory.mktemp("whole")
    out, _ = started(folder, "processes").communicate(timeout=PATIENCE)
    assert out.count(": finished after 40,960 steps") == 2, out
    return {name: read_policy(folder / name / "best").weights for name in NAMES}


def assert_the_same(folder, whole):
    for name in NAMES:
        for entry, weights in read_policy(folder / name / "best").weights.items():
            np.testing.assert_array_equal(weights, whole[name][entry])


def test_workers_that_are_killed_in_ten_moments_leave_the_policies_as_they_were(tmp_path, kind, whole):
    draw, killed, seen = random.Random(20_240_601), [], dict.fromkeys(NAMES, 0)
    process = started(tmp_path, kind, "--retries", "20")
    try:
        for k in range(KILLS):
            until(lambda: process.poll() is not None or set(workers(process, kind)) - set(killed))
            if k % 2:
                # Every other one comes while something is trained, the others may come before.
                before = farthest(tmp_path)
                until(lambda before=before: process.poll() is not None or farthest(tmp_path) > before)
            assert process.poll() is None, process.communicate()[0]
            time.sleep(draw.uniform(0.0, 2.0))
            alive = sorted(set(workers(process, kind)) - set(killed))
            if not alive:
                continue
            victim = draw.choice(alive)
            os.kill(victim, signal.SIGKILL)
            killed.append(victim)
            for name in NAMES:
                now = latest(tmp_path / name)
                # Whoever begins anew would write earlier ones, and remove the later.
                assert now >= seen[name]
                seen[name] = now
            print(f"killed: checkpoints of {seen}")
        out, _ = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    print(out)
    assert process.returncode == 0, out
    assert len(killed) == KILLS
    assert out.count("goes on from what it has stored") >= KILLS - 2
    assert_the_same(tmp_path, whole)


def test_driver_that_is_killed_takes_its_workers_along_and_is_resumed(tmp_path, kind, whole):
    process = started(tmp_path, kind)
    until(lambda: process.poll() is not None or all(latest(tmp_path / name) > 0 for name in NAMES))
    assert process.poll() is None, process.communicate()[0]
    others = workers(process, kind)
    assert len(others) == 2
    process.kill()
    process.communicate(timeout=PATIENCE)
    until(lambda: not any(alive(pid) for pid in others))
    reached = {name: latest(tmp_path / name) for name in NAMES}
    resumed = started(tmp_path, kind, "--resume")
    out, _ = resumed.communicate(timeout=PATIENCE)
    assert resumed.returncode == 0, out
    for name in NAMES:
        assert all(steps >= reached[name] for steps in steps_of(out, name)), (reached, out)
    assert_the_same(tmp_path, whole)


def test_ctrl_c_keeps_the_best_policies_and_leaves_no_worker(tmp_path, kind, whole):
    process = started(tmp_path, kind)
    until(lambda: process.poll() is not None or all((tmp_path / name / "best.json").exists() for name in NAMES))
    others = workers(process, kind)
    os.killpg(process.pid, signal.SIGINT)
    out, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, out
    assert "Traceback" not in out
    for name in NAMES:
        assert f"{name}: not finished after " in out, out
    until(lambda: not any(alive(pid) for pid in others))
    resumed = started(tmp_path, kind, "--resume")
    # Whoever is stopped between two rollouts ends as many steps later.
    out, _ = resumed.communicate(timeout=PATIENCE)
    assert len(re.findall(r": finished after 4[01],\d{3} steps", out)) == 2, out


def alive(pid):
    stat = Path(f"/proc/{pid}/stat")
    try:
        return stat.read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False

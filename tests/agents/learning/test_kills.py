"""Trainings killed at random moments, disks that fill and folders that vanish in the middle, two benchmarks at once."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from agents.learning.train import train
from elbow_gym.baselines.policy import read_policy
from tests.support.kills import FILLER, long_run

ROOT = Path(__file__).parents[3]
KILLS, SEED = 30, 20_240_601


@pytest.mark.soak
@pytest.mark.parametrize("kind", ["ppo", "sac"])
def test_training_that_was_killed_at_random_moments_ends_bit_for_bit_as_the_one_that_was_not(tmp_path, kind):
    whole, started = long_run(kind, tmp_path / "whole"), time.perf_counter()
    result = train(whole)
    # All kills together leave half of the training undone, however fast the machine is.
    latest = (time.perf_counter() - started) / KILLS
    words = [kind, tmp_path / "killed", KILLS, SEED, latest]
    command = [sys.executable, "-m", "tests.support.kills", *map(str, words)]
    ended = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    print(ended.stdout)
    *kills, last = [line for line in ended.stdout.splitlines() if line.startswith(("killed ", "finished", "failed"))]
    assert last == "finished", ended.stderr
    assert len(kills) == KILLS
    # Most leave a checkpoint that the next one goes on from.
    assert len({line.split()[-1] for line in kills}) > KILLS // 6
    assert "damaged" not in ended.stderr
    killed = long_run(kind, tmp_path / "killed")
    assert killed.files.result()["best"] == result["best"]
    columns = [[row[:1] + row[3:] for row in run.files.evaluations()] for run in (whole, killed)]
    assert columns[0] == columns[1]
    assert columns[0][-1][1:] != columns[0][-2][1:], "the policy must still change to the end"
    for name, weights in read_policy(whole.folder / "best").weights.items():
        np.testing.assert_array_equal(read_policy(killed.folder / "best").weights[name], weights)


TROUBLED = """
import os, resource, shutil, sys
from pathlib import Path
from agents.learning.callback import Keeper
from tests.support.kills import fill, long_run
from agents.learning.train import train_all
on_step = Keeper._on_step
def step(keeper):
    if keeper.num_timesteps > {begin}:
        {trouble}
    return on_step(keeper)
Keeper._on_step = step
from agents.cli import Commands
app = Commands("program", "Trains until there is trouble.")
@app.command
def go() -> None:
    train_all([long_run("{kind}", Path(sys.argv[1]))])
app.run(["go"])
"""
TROUBLES = {
    "full": ("fill(Path(sys.argv[1]).parent)", "No space left on device"),
    "limited": ("resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))", "File too large"),
    "gone": (
        "shutil.rmtree(sys.argv[1], ignore_errors=True)",
        "(No such file or directory|the run's folder is gone, or its run.json)",
    ),
    "forbidden": ("os.geteuid() or os.seteuid(65534)", "Permission denied"),
}
"""Faults in the middle of a training, and how the sentence on each begins."""


@pytest.fixture
def disk(tmp_path):
    """A disk of 20 MB in memory."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=20m", "none", str(place)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("only the superuser can make a disk, and only where that is allowed")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.soak
@pytest.mark.parametrize(("kind", "begin"), [("ppo", 4096), ("sac", 1000)])
@pytest.mark.parametrize("trouble", TROUBLES)
def test_trouble_with_the_disk_in_the_middle_ends_with_a_sentence_and_the_run_goes_on_later(
    tmp_path, trouble, kind, begin, request
):
    if trouble == "forbidden" and os.geteuid() != 0:
        pytest.skip("only the superuser can give up a permission in the middle")
    code, message = TROUBLES[trouble]
    folder = (request.getfixturevalue("disk") if trouble == "full" else tmp_path) / "run"
    script = TROUBLED.format(trouble=code, kind=kind, begin=begin)
    ended = subprocess.run(
        [sys.executable, "-c", script, str(folder)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1, ended.stderr
    print(ended.stderr.splitlines()[-1])
    assert re.match(f"error: {message}: {folder}", ended.stderr.splitlines()[-1]), ended.stderr
    assert "Traceback" not in ended.stderr
    assert re.match(f"run: failed: {message}: {folder}", ended.stdout.splitlines()[-1])
    run = long_run(kind, folder)
    if trouble == "full":
        (folder.parent / FILLER).unlink()
    if trouble != "gone":
        assert run.files.checkpoint().progress()["steps"] > 0
        whole = train(long_run(kind, tmp_path / "whole"))
        assert train(run, resume=True)["best"] == whole["best"]


@pytest.mark.soak
def test_two_energy_benchmarks_at_once_in_one_folder_write_the_same(tmp_path):
    code = (
        "import sys; from pathlib import Path; from benchmarks.energy.run import energy;"
        "energy(Path(sys.argv[1]), episodes=1, folder=Path(sys.argv[2]), parallel=False)"
    )
    command = [sys.executable, "-c", code]
    both = [
        subprocess.Popen([*command, str(tmp_path / "out"), str(tmp_path / "cells")], cwd=ROOT, stderr=subprocess.PIPE)
        for _ in range(2)
    ]
    for process in both:
        err = process.communicate()[1].decode()
        assert process.returncode == 0, err
        assert "measured again" not in err
    assert not [path for folder in ("out", "cells") for path in (tmp_path / folder).glob(".*")]
    alone = [*command, str(tmp_path / "alone"), str(tmp_path / "own")]
    subprocess.run(alone, cwd=ROOT, capture_output=True, check=True)
    assert (tmp_path / "out" / "energy.csv").read_bytes() == (tmp_path / "alone" / "energy.csv").read_bytes()
    assert len(list((tmp_path / "cells").iterdir())) == len(list((tmp_path / "own").iterdir()))

"""Two builds side by side: trainings in processes of their own, and their table."""

import csv
import json
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import builds
from benchmarks.learning import Goal

ANSWER = {"arms": 128, "steps": 1000, "training_seconds": 0.5, "beaten_after": [1000, 0.5, 0.6], "best_return": -36.0}
SECONDS = {"arms": 0.1, "rollout": 0.1, "update": 0.3, "evaluation": 0.07, "checkpoint": 0.01}


@pytest.fixture
def script(monkeypatch, tmp_path):
    """A training that prints an answer and writes down how it was called."""
    answer = {**ANSWER, **{f"{part}_seconds": seconds for part, seconds in SECONDS.items()}}
    path = tmp_path / "script.py"
    path.write_text(
        "import json, os, sys\n"
        "with open('calls', 'a') as calls:\n"
        "    print(json.dumps([sys.argv[1:], os.environ['PYTHONPATH'], os.environ['OMP_NUM_THREADS']]), file=calls)\n"
        f"print('a line')\nprint({json.dumps(answer)!r})\n"
    )
    monkeypatch.setattr(builds, "SCRIPT", path)
    return path


def test_training_runs_in_the_builds_own_checkout_on_one_core(script, tmp_path):
    row = builds.race("before", tmp_path, Path(sys.executable), 1, 3, Goal(800.0, 12.5), num_envs=8)
    assert row == ["before", 1, 3, 128, 1000, "0.5", "0.1", "0.1", "0.3", "0.07", "0.01", 1, "-36"]
    assert len(row) == len(builds.HEADER)
    [words, place, threads] = json.loads((tmp_path / "calls").read_text())
    assert words == ["1", "3", '{"num_envs": 8}', "800.0", "12.5"]
    assert (place, threads) == (str(tmp_path), "1")
    script.write_text("raise SystemExit('no such arm')")
    with pytest.raises(ChildProcessError, match=r"training in .* failed: \['no such arm'\]"):
        builds.race("now", tmp_path, Path(sys.executable), 1, 3, Goal(800.0, 12.5))


def test_builds_train_in_turn_and_one_that_fails_has_no_row(monkeypatch, tmp_path, capsys):
    def race(build, checkout, python, elbows, seed, goal, **settings):
        if (build, elbows, seed) == ("before", 1, 1):
            raise ChildProcessError("no such arm")
        return [build, elbows, seed, settings.get("num_envs", 128), *[1.0] * 9]

    monkeypatch.setattr(builds, "race", race)
    monkeypatch.setattr(builds, "goals", lambda _: dict.fromkeys(("elbows2", "elbows1", "elbows0"), Goal(800.0, 12.0)))
    builds.measure(tmp_path, None, 2, tmp_path)
    with (tmp_path / "builds.csv").open(newline="") as handle:
        names = [(row["build"], row["elbows"], row["arms [-]"]) for row in csv.DictReader(handle)]
    turn = [
        (build, *task)
        for task in (("2", "128"), ("1", "128"), ("0", "128"), ("2", "256"))
        for build in ("before", "now")
    ]
    assert names == [*turn, *(one for one in turn if one != ("before", "1", "128"))]
    assert "before, one elbow, seed 1: no such arm" in capsys.readouterr().err


def test_table_has_medians_of_each_build(tmp_path):
    rows = []
    for build, factor in (("before", 2.0), ("now", 1.0)):
        for seed, steps in enumerate((1000, 2000, 6000)):
            training = factor * 0.001 * steps
            rows.append([build, 2, seed, 128, steps, training, *(0.2 * training,) * 5, 1, -36.0 - seed])
    rows.append(["now", 2, 0, 256, 1000, 0.5, *(0.1,) * 5, 0, -90.0])
    with (tmp_path / "builds.csv").open("w", newline="") as handle:
        csv.writer(handle).writerows([builds.HEADER, *rows])
    header, before, now, full = builds.save(tmp_path)
    assert before[:8] == ("two elbows", "128", "before", "3", "3", "2e+03", "4", "500")
    assert now[:8] == ("two elbows", "128", "now", "3", "3", "2e+03", "2", "1e+03")
    assert before[8:] == ("400",) * 4
    assert full[4] == "-"
    assert len(header) == len(before)
    assert (tmp_path / "builds.md").read_text().count("\n") == 5
    assert builds.save(tmp_path / "nowhere") == []


TWICE = """
import runpy, sys
words = sys.argv[1:]
for goal in ("0", "1e9"):
    sys.argv = [*words, goal, goal]
    runpy.run_path(words[0], run_name="__main__")
"""
"""The script for a goal that is never reached, then for one that is at once: libraries are imported once."""


@pytest.mark.slow
def test_script_trains_and_says_where_the_time_goes():
    settings = json.dumps({"num_envs": 4, "total_timesteps": 512, "n_steps": 64, "batch_size": 64})
    place = str(builds.SCRIPT.parents[1])
    words = [sys.executable, "-c", TWICE, str(builds.SCRIPT), "2", "0"]
    ran = subprocess.run([*words, settings], capture_output=True, text=True, check=True, cwd=place,
                         env={"PYTHONPATH": place})  # fmt: skip
    never, at_once = (json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{"))
    assert (never["steps"], never["beaten_after"]) == (512, [])
    assert at_once["beaten_after"][0] == at_once["steps"] == 0
    parts = sum(never[f"{part}_seconds"] for part in ("arms", "rollout", "update"))
    assert parts == pytest.approx(never["training_seconds"])
    assert min(never[f"{part}_seconds"] for part in builds.PARTS) > 0.0
